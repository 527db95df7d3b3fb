"""Every model that was measured has its place in the table of models."""

from pathlib import Path
from types import SimpleNamespace

import pandas as pd

from palpate.files import read_yaml
from palpate.models.model_registry import MODELS, RESERVED
from palpate.report.parts import models as sections_models

FAMILIES = read_yaml(Path(__file__).parents[3] / "workflow/report/models.yaml")


def table(models):
    measured = pd.DataFrame({"model": models, "setting": [f"k={i}" for i in range(len(models))]})
    report = SimpleNamespace(tables={"accuracy_vs_time": measured}, published={"models": FAMILIES})
    ((_, _, text),) = sections_models.sections(report)
    return text


def test_every_model_is_described():
    described = [name for family in FAMILIES for name in family["names"]]
    assert len(described) == len(set(described))
    assert set(MODELS) | set(RESERVED) <= set(described)


def test_families_of_which_nothing_was_measured_are_left_out():
    text = table(["fem_fine", "fem_fine", "fem_coarse", "pod_rbf"])
    assert "<td>finite elements</td>" in text and "<td>reduced basis</td>" in text
    assert "mass-spring" not in text
    assert '<td class="number">2</td><td class="number">2</td>' in text  # two forms, of two settings at most


def test_an_own_model_is_told_of():
    assert "<td>mine</td><td>a model of your own</td>" in table(["pod_rbf", "mine"])
