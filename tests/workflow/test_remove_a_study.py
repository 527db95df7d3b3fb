"""A study is removed by its folder, its rules and one line; nothing else names it."""

import ast
import re
import shutil
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
STUDY = "law"


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    """A copy of the sources without the study: its folder, its rules file, its line, and its block of the settings."""
    tmp_path = tmp_path_factory.mktemp("copy")
    for name in ("src", "workflow", "tests/smoke", "docs", "examples"):
        left_out = shutil.ignore_patterns("__pycache__", "*.egg-info", "results", ".snakemake", "*.png")
        shutil.copytree(ROOT / name, tmp_path / name, ignore=left_out)
    for name in ("Snakefile", "config.yaml", "pyproject.toml"):
        shutil.copy(ROOT / name, tmp_path / name)
    shutil.rmtree(tmp_path / f"src/palpate/studies/{STUDY}")
    (tmp_path / f"workflow/rules/{STUDY}.smk").unlink()
    registered = tmp_path / "src/palpate/run/settings.py"
    text, count = re.subn(rf'^ *"{STUDY}",? *\n', "", registered.read_text(encoding="utf-8"), flags=re.MULTILINE)
    assert count == 1
    registered.write_text(text, encoding="utf-8")
    for config in (tmp_path / "config.yaml", tmp_path / "tests/smoke/config.yaml"):
        text = re.sub(rf"^{STUDY}:.*\n(?:(?:[ #].*)?\n)*", "", config.read_text(encoding="utf-8"), flags=re.MULTILINE)
        config.write_text(text, encoding="utf-8")
    return tmp_path


@pytest.mark.slow
def test_nothing_else_names_the_study(copy):
    """No import and no rule names its modules, its rules file or its target."""
    for path in (copy / "src").rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        assert f"studies.{STUDY}" not in text, path
        names = {line.value for line in ast.walk(ast.parse(text)) if isinstance(line, ast.Constant)}
        assert f"{STUDY}.csv" not in names, path
    for path in [copy / "Snakefile", *(copy / "workflow").rglob("*.smk")]:
        text = path.read_text(encoding="utf-8")
        assert f"studies.{STUDY}" not in text and f"{STUDY}.smk" not in text, path
