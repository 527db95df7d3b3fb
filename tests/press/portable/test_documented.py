"""The page about portable models is true: its examples run, and it joins the errors as all other places do."""

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from press.portable.conftest import RUNTIMES

PAGE = (Path(__file__).parents[3] / "docs/portable-model.md").read_text(encoding="utf-8")


def example(language: str) -> str:
    """Return the only example in a language."""
    (found,) = re.findall(rf"^```{language}\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    return found


def in_c(folder, made_up, compiled) -> list[str]:
    (folder / "press.c").write_text(example("c"))
    return [str(compiled(folder / "press.c"))]


def in_python(folder, made_up, compiled) -> list[str]:
    (folder / "press.py").write_text(example("python"))
    return [sys.executable, "-W", "error", str(folder / "press.py")]


@pytest.mark.slow
@pytest.mark.parametrize("command", [in_c, in_python])
def test_the_example_runs_as_it_stands(command, tmp_path, made_up, compiled, model):
    (tmp_path / "block.palpate").write_bytes(made_up.data)
    (tmp_path / "broken.palpate").write_bytes(made_up.data[:-9])
    words = command(tmp_path, made_up, compiled)
    place = {"PYTHONPATH": str(RUNTIMES)}
    done = [
        subprocess.run([*words, str(tmp_path / name)], capture_output=True, text=True, env=os.environ | place)
        for name in ("block.palpate", "broken.palpate")
    ]
    right = model.respond([{"triangle": 7, "weights": [0.2, 0.3, 0.5], "force": [0, 0, -0.2]}])
    peak = float(np.linalg.norm(right.displacement, axis=1).max())
    assert peak > 1e-3 and done[0].stderr == ""
    worth = f"error {100 * right.error:.1f} % of it; {right.doubt or 'believed'}"
    assert done[0].stdout == f"{1e3 * peak:.3f} mm, {worth}\n"
    assert done[1].returncode == 1 and "the file" in done[1].stderr and done[1].stdout == ""
