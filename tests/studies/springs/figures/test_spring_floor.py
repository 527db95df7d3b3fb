"""The least error that springs reach is drawn for every press."""

from palpate.studies.springs import figures


def test_the_floor_is_drawn_for_each_press(spring_results):
    figure = figures.draw_spring_floor(spring_results["spring_floor"])
    assert [axis.get_title("left") for axis in figure.axes] == ["top press", "left press", "front press"]
    alone, tied = figure.axes[0].lines[1:]
    assert (alone.get_ydata() > tied.get_ydata()).all()
