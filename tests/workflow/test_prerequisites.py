"""What this system lacks is said in one sentence, before anything is built."""

import importlib.util
import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

ROOT = Path(__file__).parents[2]
SCRIPT = ROOT / "workflow/prerequisites.py"


@pytest.fixture(scope="module")
def prerequisites():
    """The script as a module."""
    spec = importlib.util.spec_from_file_location("prerequisites", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def lacking(prerequisites, monkeypatch):
    """What is said where these libraries, modules and programs are missing."""

    def say(libraries=(), modules=(), programs=(), version=(3, 12, 1), left_gb=50.0) -> str:
        usage = SimpleNamespace(free=left_gb * 1e9)
        system = SimpleNamespace(version_info=version, platform="linux")
        shell = SimpleNamespace(
            which=lambda program: None if program in programs else program, disk_usage=lambda folder: usage
        )
        monkeypatch.setattr(prerequisites, "loads", lambda library: library not in libraries)
        monkeypatch.setattr(prerequisites, "find_spec", lambda module: None if module in modules else module)
        monkeypatch.setattr(prerequisites, "shutil", shell)
        monkeypatch.setattr(prerequisites, "sys", system)
        return prerequisites.missing()

    return say


def test_here_nothing_is_missing():
    done = subprocess.run([sys.executable, SCRIPT], cwd=ROOT, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_a_library_that_is_not_there_cannot_be_loaded(prerequisites):
    assert prerequisites.loads("libc.so.6") and not prerequisites.loads("libpalpate.so.1")


@pytest.mark.parametrize(
    ("missing", "said"),
    [
        (
            {"libraries": ["libGL.so.1", "libXft.so.2"], "modules": ["ensurepip"]},
            "palpate needs Python's venv, libGL.so.1, libXft.so.2, which this system lacks: "
            "apt-get install python3.12-venv libgl1 libxft2",
        ),
        (
            {"libraries": ["libGLU.so.1"], "programs": ["apt-get"]},
            "palpate needs libGLU.so.1, which this system lacks: install the packages of your system that hold them",
        ),
        (
            {"version": (3, 9, 2)},
            "palpate needs Python 3.11 or newer, and this is 3.9; name another: make PYTHON=python3.11",
        ),
        ({"left_gb": 0.96}, "palpate's environment needs 2.2 GB of disk, and 1.0 GB are left here"),
        ({}, ""),
    ],
)
def test_what_is_missing_is_told_in_one_sentence(lacking, missing, said):
    assert lacking(**missing) == said


def test_the_oldest_python_is_the_projects(prerequisites):
    oldest = ".".join(map(str, prerequisites.OLDEST))
    assert f'requires-python = ">={oldest}"' in (ROOT / "pyproject.toml").read_text()


@pytest.mark.parametrize("python", ["python-that-is-missing", "false"])
def test_make_stops_before_it_builds(python, tmp_path, prerequisites):
    venv = tmp_path / "venv"
    words = ["make", "--no-print-directory", f"VENV={venv}", f"PYTHON={python}", f"{venv}/.whole"]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode != 0 and not venv.exists()
    if python != "false":
        said = re.fullmatch(r"palpate needs Python 3.11 or newer.*: apt-get install (.*)\n", done.stdout)
        assert said[1].split() == ["python3-venv", *prerequisites.LIBRARIES.values()]
