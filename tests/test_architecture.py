"""Imports point one way, and the page about the architecture has a row for every package."""

import ast
import re
from pathlib import Path

import pytest

import palpate

ROOT = Path(palpate.__file__).parent
DOCS = Path(__file__).parents[1] / "docs"
ORDER = ["linalg", "bodies", "effects", "collision", "solvers", "scenes", "benchmark", "models", "identification"]
ORDER += ["report", "run", "press", "exchange", "studies", "init"]
"""The packages; each imports from those before it only."""


def imported(path):
    """The packages of palpate that a module imports, anywhere in it."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        names = []
        if isinstance(node, ast.ImportFrom) and node.module:
            whole = node.module == "palpate"
            names = [f"palpate.{name.name}" for name in node.names] if whole else [node.module]
        elif isinstance(node, ast.Import):
            names = [name.name for name in node.names]
        yield from (name.split(".")[1] for name in names if name.startswith("palpate."))


@pytest.mark.parametrize("package", ORDER)
def test_imports_point_one_way(package):
    before = set(ORDER[: ORDER.index(package)])
    wrong = {
        f"{path.name} imports {name}"
        for path in (ROOT / package).rglob("*.py")
        for name in imported(path)
        if name in ORDER and name != package and name not in before
    }
    assert wrong == set()


def test_a_study_does_not_import_another():
    for path in sorted((ROOT / "studies").glob("*/**/*.py")):
        own = path.relative_to(ROOT / "studies").parts[0]
        named = re.findall(r"^\s*(?:from|import) palpate\.studies\.(\w+)", path.read_text(encoding="utf-8"), flags=re.M)
        assert set(named) <= {own, *(shared.stem for shared in (ROOT / "studies").glob("*.py"))}, path


def test_every_package_has_its_place():
    packages = {path.parent.name for path in ROOT.glob("*/__init__.py")}
    assert packages == set(ORDER)
    page = (DOCS / "architecture.md").read_text(encoding="utf-8")
    assert [name for name in packages if f"| `{name}/` |" not in page] == []
