"""Figures that only read tables are drawn by one rule, so their functions have one contract."""

import inspect
from importlib import import_module
from pathlib import Path

import pytest

from palpate import report as figures

ROOT = Path(figures.__file__).parent
DRAWN = sorted(path for path in ROOT.glob("*/*.py") if "\nTABLES = " in path.read_text(encoding="utf-8"))
OPTIONS = {"scene", "published"}
"""What the rule may pass by keyword: the scene of a figure that comes once a scene, and the numbers of a paper."""


@pytest.mark.parametrize("path", DRAWN, ids=lambda path: f"{path.parent.name}.{path.stem}")
def test_a_drawing_function_takes_its_tables_in_order(path):
    module = import_module(f"palpate.report.{path.parent.name}.{path.stem}")
    parameters = inspect.signature(module.draw).parameters.values()
    assert tuple(p.name for p in parameters if p.kind is not p.KEYWORD_ONLY) == module.TABLES
    assert {p.name for p in parameters if p.kind is p.KEYWORD_ONLY and p.default is p.empty} <= OPTIONS


def test_every_study_with_figures_of_tables_is_found():
    assert {path.parent.name for path in DRAWN} == {
        "collision", "ct", "dynamic", "enrichment", "hard_cases", "law", "measured", "organ_springs", "palpation",
        "scaling", "scenes", "shape_matching", "springs", "tradeoff",
    }  # fmt: skip
