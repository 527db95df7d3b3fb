"""The matrix of hard cases shows the outcomes of its table."""

from matplotlib.colors import to_hex

from palpate.studies.hard_cases import figures


def test_a_cell_for_each_run_in_its_outcomes_colour(hard_cases_table):
    figure = figures.draw_hard_cases(hard_cases_table)
    assert len(figure.axes) == 3
    drawn = [to_hex(patch.get_facecolor()) for axis in figure.axes for patch in axis.patches]
    expected = ["stable", "stable", "refused", "wrong", "nan"]
    assert drawn == [figures.LOOKS[outcome].colour for outcome in expected]
    assert [sum(line.get_marker() == "x" for line in axis.lines) for axis in figure.axes] == [0, 1, 1]
    assert [label.get_text() for label in figure.axes[0].get_yticklabels()] == ["locking", "no anchor"]
