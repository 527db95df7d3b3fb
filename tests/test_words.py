"""Docstrings are in plain English: those of functions begin with a verb, and none begins with a question word."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
VERBS = set((ROOT / "tests/verbs.txt").read_text(encoding="utf-8").split())
"""The verbs that docstrings begin with so far; add yours to the file."""

QUESTIONS = {"What", "Which", "Where", "Whether", "How", "Why", "When", "Who", "Whose"}


def docstrings(path: Path) -> Iterator[tuple[str, ast.AST, str]]:
    """Yield the place, the node and the first word of each docstring in a module."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and (text := ast.get_docstring(node)):
            name = getattr(node, "name", "module")
            yield f"{path.relative_to(ROOT)}:{name}", node, text.split()[0].rstrip(":,.;")


def is_property(node: ast.AST) -> bool:
    """Return whether a function is a property, which is named like a thing."""
    names = [getattr(item, "id", getattr(item, "attr", "")) for item in getattr(node, "decorator_list", [])]
    return any(name in {"property", "cached_property", "setter", "fixture"} for name in names)


@pytest.mark.parametrize("package", sorted(path.name for path in (ROOT / "src/palpate").iterdir()))
def test_docstrings_begin_with_a_verb(package):
    place = ROOT / "src/palpate" / package
    wrong = []
    for path in sorted(place.rglob("*.py")) if place.is_dir() else [place] * (place.suffix == ".py"):
        for name, node, word in docstrings(path):
            action = isinstance(node, ast.FunctionDef) and not is_property(node)
            if word in QUESTIONS or (action and word not in VERBS):
                wrong.append(f"{name}: {word}")
    assert wrong == []
