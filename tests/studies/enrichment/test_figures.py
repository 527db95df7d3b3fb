"""The work–precision diagram of enrichment names failures and frame budgets."""

from pathlib import Path

import numpy as np
import pytest
from fixtures.drawn import texts

from palpate.errors import InputError
from palpate.files import read_yaml
from palpate.report import model_looks, style
from palpate.studies.enrichment.figures import bodies, charts


@pytest.mark.slow
def test_deformed_bodies_shows_different_contacts_and_true_errors(body, database, predictions_file, tmp_path):
    found = bodies.read(predictions_file, "paper", "samples", bodies.DEFORMED_BY)
    figure = bodies.draw_deformed_bodies(body, database, found)
    pictures = [axis for axis in figure.axes if axis.images]
    assert len(pictures) == bodies.SAMPLES * 6
    shown = [int(t.split(":")[0].split()[1]) for t in texts(figure) if t.startswith("sample")]
    assert len(set(database.contact[shown])) == bodies.SAMPLES
    assert (np.diff(database.peaks[shown]) >= 0).all()
    i = shown[0]
    rms = np.sqrt(np.mean(np.sum(database.fine[i] ** 2, axis=1)))
    wrong = 100 * 0.3 * (1 + i / 10) * rms / database.peaks[i]
    assert f"error {wrong:.2g} % of peak" in texts(figure)
    style.save(figure, tmp_path / "deformed")


def test_error_over_body_ranks_each_method(body, database, predictions_file):
    found = bodies.read(predictions_file, "paper", "samples", bodies.JUDGED)
    figure = bodies.draw_error_over_body(body, database, {"paper protocol, samples held out": found})
    samples = [int(t.split(":")[0].split()[1]) for t in texts(figure) if t.startswith("sample")]
    assert samples == [0, 4, 7] * 3  # conftest: the later the sample the worse


def test_times_are_drawn_over_peaks_in_millimetres(results):
    figure = charts.draw_fem_cost(results["fem_cost"], results["sample_peaks"])
    np.testing.assert_allclose(figure.axes[0].lines[0].get_xdata(), [4, 5, 6, 7])


def test_a_missing_file_or_group_is_named(predictions_file, tmp_path):
    with pytest.raises(InputError, match=r"nothing\.h5 is missing"):
        bodies.read(tmp_path / "nothing.h5", "paper", "samples", ["detail_correction"])
    with pytest.raises(InputError, match=r"predictions\.h5 is damaged"):
        bodies.read(predictions_file, "live", "contacts", ["detail_correction"])


def test_rows_go_from_local_to_global(results):
    figure = charts.draw_premises(results["premises"], results["premise_bodies"])
    left, right = figure.axes
    labels = [label.get_text() for label in left.get_yticklabels()]
    assert [label.split("\n")[0] for label in labels] == ["pad", "bent", "own*"]
    assert labels[0].endswith("20 % of the surface moves")
    ordered = model_looks.look("ordered_nonnegative_a").colour
    marks = [line for line in right.lines if line.get_color() == ordered and line.get_marker() == "s"]
    assert [line.get_xdata()[0] for line in marks] == pytest.approx([0.2, 0.9, 1.0])


def test_sigma_sweep_marks_the_chosen_and_the_papers_sigma(results):
    paper = read_yaml(Path(bodies.__file__).parents[1] / "published.yaml")
    figure = charts.draw_sigma_sweep(results["sigma_sweep"], results["enrichment_accuracy"], published=paper)
    assert len(figure.axes) == 4 * 3
    liver, own = figure.axes[0], figure.axes[6]
    marks = {line.get_marker(): line.get_xdata()[0] for line in liver.lines if line.get_marker() in ("o", "D")}
    assert marks["o"] == pytest.approx(1.0)  # conftest: 0.01 m at a median distance of 0.01 m
    assert marks["D"] == pytest.approx(paper["sigma"]["value"] * paper["sigma"]["unit_m"]["liver"] / 0.01)
    assert "D" not in {line.get_marker() for line in own.lines}


def test_exponents_are_drawn_beside_those_of_the_papers_order(results):
    figure = charts.draw_complexity(results["complexity"])
    drawn = {(line.get_marker(), float(line.get_xdata()[0])) for line in figure.axes[0].lines}
    assert {("o", 0.9), ("o", 1.05), ("D", 1.0)} <= drawn
