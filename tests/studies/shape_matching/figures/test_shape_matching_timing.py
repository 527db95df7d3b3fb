"""Times of shape matching are drawn beside the thesis' headline."""

from palpate.studies.shape_matching import figures


def test_the_figure_marks_the_thesis(shape_matching_results):
    table = shape_matching_results["shape_matching_timing"]
    figure = figures.draw_shape_matching_timing(table.assign(ms_per_step=3.21e-5 * table["all_particles"]))
    written = [text.get_text() for axis in figure.axes for text in axis.texts]
    assert any("20 ms" in line and "here: 0.32 ms" in line for line in written)
    assert len(figure.axes) == table["clusters"].nunique() + 1
