"""The small diagram shows the models on the front, and everything else in grey."""

import pytest
from fixtures.drawn import texts

from palpate.report import style
from palpate.report.model_looks import look
from palpate.studies.tradeoff.figures import precision


@pytest.fixture
def figure(trade_off_tables):
    return precision.draw_best_models(
        trade_off_tables["accuracy_vs_time"], trade_off_tables["advice"], scene="liver_small"
    )


def test_the_front_is_numbered_and_named(figure, tmp_path):
    written = [text.replace("\u00a0", " ") for text in texts(figure)]
    assert [text for text in written if text.isdigit() and len(text) == 1] == ["1", "2", "3", "4"]
    assert "1  linear fine FEM: 1.7 % in 12 µs" in written and "4  corrected coarse FEM: 0.6 % in 3.8 ms" in written
    assert "16.7 ms" in written
    style.save(figure, tmp_path / "best_models")


def test_only_the_front_is_coloured(figure, trade_off_tables):
    axis = figure.axes[0]
    large = [line.get_color() for line in axis.lines if line.get_markersize() > 10]
    assert large == [look(name).colour for name in ("linear_fem", "linear_residual", *["detail_correction"] * 2)]
    (grey,) = (line for line in axis.lines if line.get_markersize() == 3)
    table = trade_off_tables["accuracy_vs_time"]
    shown = (table["scene"] == "liver_small") & (table["failures"] == 0) & ~table["model"].isin(["zero", "truth"])
    assert len(grey.get_xdata()) == shown.sum()  # what failed on some samples has no place, nor truth and zero answer


def test_the_truth_and_the_zero_answer_limit_the_errors(figure):
    axis = figure.axes[0]
    assert max(patch.get_y() + patch.get_height() for patch in axis.patches) == pytest.approx(0.09)
    assert [line.get_ydata()[0] for line in axis.lines if line.get_color() == look("zero").colour] == [33.0]


def test_it_is_as_wide_as_a_telephone(figure):
    assert 96 * figure.get_figwidth() < 390 - 32
