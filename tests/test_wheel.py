"""The wheel works outside of the checkout, with the packages that everybody needs alone."""

import subprocess
import sys
from pathlib import Path

import pytest

from palpate.errors import EXTRAS

ROOT = Path(__file__).parents[1]
WITHOUT = """
import sys
class Without:
    def find_spec(self, name, *rest):
        if name.partition(".")[0] in {extras}:
            raise ModuleNotFoundError("no " + name, name=name)
sys.meta_path.insert(0, Without())
"""
DROP = """
import palpate as pp
assert pp.__file__.startswith({folder!r}), pp.__file__
cube = pp.Box(sizes_m=(0.1, 0.1, 0.1), divisions=(2, 2, 2), young_pa=20e3, poisson=0.3)
motion = pp.simulate(cube, [pp.Gravity(), pp.Contact(instruments=[pp.Floor(height_m=-0.01)])], step_s=0.02, duration_s=0.5)
print(motion.force("floor")[-1, 2])
try:
    motion.save("drop.gif")
except pp.InputError as error:
    print(error)
"""


@pytest.mark.slow
def test_a_cube_drops_with_nothing_but_the_library(tmp_path):
    build = [
        sys.executable,
        "-m",
        "pip",
        "--disable-pip-version-check",
        "wheel",
        "-q",
        "--no-deps",
        "--no-build-isolation",
    ]
    subprocess.run([*build, "-w", tmp_path, ROOT], check=True)
    (wheel,) = tmp_path.glob("*.whl")
    folder = tmp_path / "site"
    subprocess.run([sys.executable, "-m", "zipfile", "-e", wheel, folder], check=True)
    script = (
        WITHOUT.format(extras=set(EXTRAS)) + f"sys.path.insert(0, {str(folder)!r})\n" + DROP.format(folder=str(folder))
    )
    done = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True, check=True)
    weight, lacks = done.stdout.splitlines()
    assert float(weight) == pytest.approx(9.80665, rel=1e-3)
    assert "pip install 'palpate[view]'" in lacks
