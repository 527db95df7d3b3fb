"""The sweep of σ marks the chosen width and the paper's."""

from pathlib import Path

import pytest
import yaml

from palpate.studies.enrichment.figures import charts

CAPTIONS = Path(__file__).parents[4] / "src/palpate/studies"


@pytest.fixture(scope="module")
def paper():
    return yaml.safe_load((CAPTIONS / "enrichment/captions/published.yaml").read_text(encoding="utf-8"))


def test_sigma_sweep_marks_the_chosen_and_the_papers_sigma(results, paper):
    figure = charts.draw_sigma_sweep(results["sigma_sweep"], results["enrichment_accuracy"], published=paper)
    assert len(figure.axes) == 4 * 3
    liver, own = figure.axes[0], figure.axes[6]
    marks = {line.get_marker(): line.get_xdata()[0] for line in liver.lines if line.get_marker() in ("o", "D")}
    assert marks["o"] == pytest.approx(1.0)  # conftest: 0.01 m at a median distance of 0.01 m
    assert marks["D"] == pytest.approx(paper["sigma"]["value"] * paper["sigma"]["unit_m"]["liver"] / 0.01)
    assert "D" not in {line.get_marker() for line in own.lines}
