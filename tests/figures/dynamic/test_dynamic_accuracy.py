"""Errors of motion are drawn over their cost, and failures are counted."""

from palpate.figures import style
from palpate.figures.dynamic import dynamic_accuracy


def test_a_panel_a_scene_and_failures_counted(dynamic_table, tmp_path):
    figure = dynamic_accuracy.draw(dynamic_table)
    assert [axis.get_title("left") for axis in figure.axes] == [
        f"{s}, 1 did not converge" for s in ("liver press", "bar sag")
    ]
    springs = figure.axes[0].lines[1]
    assert springs.get_ydata().tolist() == [5.0, 4.0]
    style.save(figure, tmp_path / "dynamic_accuracy")
