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
SAG = """
import palpate as pp
assert pp.__file__.startswith({folder!r}), pp.__file__
foot = pp.Plane(axis="z", side="min", depth_m=0.001)
cube = pp.Box(sizes_m=(0.1, 0.1, 0.1), divisions=(2, 2, 2), young_pa=20e3, poisson=0.0, anchors=foot)
motion = pp.simulate(cube, [pp.Gravity(), pp.Rayleigh(mass_1_s=50)], step_s=0.02, duration_s=1.0)
print(-motion.positions[-1][motion.rest[:, 2] == 0.1, 2].mean() + 0.1)
try:
    motion.save("sag.gif")
except pp.InputError as error:
    print(error)
"""


@pytest.mark.slow
def test_a_cube_sags_with_nothing_but_the_library(tmp_path):
    build = [sys.executable, "-m", "pip", "-q", "wheel", "--no-deps", "--no-build-isolation", "-w", tmp_path, ROOT]
    subprocess.run(build, check=True)
    (wheel,) = tmp_path.glob("*.whl")
    folder = str(tmp_path / "site")
    subprocess.run([sys.executable, "-m", "zipfile", "-e", wheel, folder], check=True)
    script = WITHOUT.format(extras=set(EXTRAS)) + f"sys.path.insert(0, {folder!r})\n" + SAG.format(folder=folder)
    done = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True, check=True)
    sunk_m, lacks = done.stdout.splitlines()
    assert float(sunk_m) == pytest.approx(1000 * 9.81 * 0.1**2 / (2 * 20e3), rel=0.15)  # ρ g h² / 2 E of a column
    assert "pip install 'palpate[view]'" in lacks
