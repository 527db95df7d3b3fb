"""What this system lacks is said in one sentence, before anything is built."""

import runpy
import subprocess
import sys
from ctypes import util
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SCRIPT = ROOT / "workflow/prerequisites.py"


def test_here_nothing_is_missing():
    done = subprocess.run([sys.executable, SCRIPT], cwd=ROOT, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


@pytest.mark.parametrize(
    ("lacking", "version", "said"),
    [(("GL", "Xft"), (3, 12), ": apt-get install libgl1 libxft2"), ((), (3, 9), "palpate needs Python 3.11 or newer")],
)
def test_what_is_missing_is_told_in_one_sentence(monkeypatch, lacking, version, said):
    monkeypatch.setattr(util, "find_library", lambda name: None if name in lacking else name)
    monkeypatch.setattr(sys, "version_info", version)
    with pytest.raises(SystemExit, match=said):
        runpy.run_path(str(SCRIPT))


def test_make_stops_before_it_builds(tmp_path):
    words = ["make", "--no-print-directory", f"VENV={tmp_path}/venv", "PYTHON=false", f"{tmp_path}/venv/.whole"]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode != 0 and not (tmp_path / "venv").exists()
