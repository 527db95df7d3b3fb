"""Every figure draws what its data say."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from palpate.figures import style
from palpate.figures.enrichment import (
    accuracy_vs_online_cost,
    complexity,
    deformed_bodies,
    error_over_body,
    fem_cost,
    mesh_levels,
    predictions,
    sigma_sweep,
    timing_bars,
)

CAPTIONS = Path(__file__).parents[2] / "workflow" / "report"


@pytest.fixture(scope="module")
def paper():
    return yaml.safe_load((CAPTIONS / "paper.yaml").read_text(encoding="utf-8"))


def texts(figure):
    """Everything that is written in a figure."""
    import matplotlib.text

    return [t.get_text() for t in figure.findobj(matplotlib.text.Text) if t.get_text()]


def test_deformed_bodies_shows_different_contacts_and_true_errors(body, database, predictions_file, tmp_path):
    found = predictions.read(predictions_file, "paper", "samples", deformed_bodies.METHODS)
    figure = deformed_bodies.draw(body, database, found, rows=2)
    pictures = [axis for axis in figure.axes if axis.images]
    assert len(pictures) == 2 * 6
    shown = [int(t.split(":")[0].split()[1]) for t in texts(figure) if t.startswith("sample")]
    assert len(set(database.contact[shown])) == 2
    assert (np.diff(database.peaks[shown]) >= 0).all()
    i = shown[0]
    rms = np.sqrt(np.mean(np.sum(database.fine[i] ** 2, axis=1)))
    wrong = 100 * 0.3 * (1 + i / 10) * rms / database.peaks[i]
    assert f"error {wrong:.2g} % of peak" in texts(figure)
    style.save(figure, tmp_path / "deformed")


def test_error_over_body_ranks_each_method(body, database, predictions_file):
    found = predictions.read(predictions_file, "paper", "samples", error_over_body.METHODS)
    figure = error_over_body.draw(body, database, {"paper protocol, samples held out": found})
    samples = [int(t.split(":")[0].split()[1]) for t in texts(figure) if t.startswith("sample")]
    assert samples == [0, 4, 7] * 3  # conftest: the later the sample the worse


def test_mesh_levels_counts(body):
    written = "\n".join(texts(mesh_levels.draw([body])))
    for mesh in body.levels:
        assert f"surface: {len(mesh.surface):,} nodes, {len(mesh.triangles):,} triangles" in written
        assert f"volume: {len(mesh.nodes):,} nodes, {len(mesh.tetrahedra):,} tetrahedra" in written


def test_sigma_sweep_marks_the_chosen_and_the_papers_sigma(results, paper):
    figure = sigma_sweep.draw(results["sigma_sweep"], results["enrichment_accuracy"], paper)
    assert len(figure.axes) == 4 * 3
    liver, own = figure.axes[0], figure.axes[6]
    marks = {line.get_marker(): line.get_xdata()[0] for line in liver.lines if line.get_marker() in ("o", "D")}
    assert marks["o"] == pytest.approx(1.0)  # conftest: 0.01 m at a median distance of 0.01 m
    assert marks["D"] == pytest.approx(paper["sigma"]["value"] * paper["sigma"]["unit_m"]["liver"] / 0.01)
    assert "D" not in {line.get_marker() for line in own.lines}


def test_accuracy_vs_time_names_failures_and_budgets(results):
    tables = (results[n] for n in ("enrichment_accuracy", "online_cost", "fem_cost"))
    figure = accuracy_vs_online_cost.draw(*tables)
    assert len(figure.axes) == 4 * 2
    assert texts(figure).count("failed: POD + RBF") == 4
    assert {"1 ms", "16.7 ms", "100 ms", "fine FEM", "Pareto front"} <= set(texts(figure))


def test_timing_bars_has_two_bars_only_where_the_paper_has_a_number(results):
    liver, own = timing_bars.draw(results["enrichment_timing"]).axes
    assert (len(liver.patches), len(own.patches)) == (5 + 3, 5)


def test_complexity_and_fem_cost_draw(results, tmp_path):
    style.save(complexity.draw(results["complexity"]), tmp_path / "complexity")
    figure = fem_cost.draw(results["fem_cost"], results["sample_peaks"])
    np.testing.assert_allclose(figure.axes[0].lines[0].get_xdata(), [4, 5, 6, 7])
    style.save(figure, tmp_path / "fem_cost")


def test_two_drawings_of_one_table_are_the_same_bytes(results, tmp_path):
    for name in "ab":
        style.save(timing_bars.draw(results["enrichment_timing"]), tmp_path / name)
    for suffix in ("png", "svg"):
        assert (tmp_path / f"a.{suffix}").read_bytes() == (tmp_path / f"b.{suffix}").read_bytes()
