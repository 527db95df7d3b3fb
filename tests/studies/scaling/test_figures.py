"""Scaling is drawn with its exponents."""

from fixtures.drawn import texts

from palpate.studies.scaling import figures


def test_each_component_has_a_panel_with_exponents(scaling_table):
    figure = figures.draw_scaling(scaling_table)
    titles = [axis.get_title(loc="left") for axis in figure.axes if axis.lines]
    assert titles == [*(title for title, _, _ in figures.COMPONENTS.values()), "memory"]
    assert texts(figure).count("respond: n$^{1.07}$") == len(figures.COMPONENTS)
    figure = figures.draw_scaling(scaling_table[scaling_table["component"] != "samples"])
    assert "enrichment, samples" not in [axis.get_title(loc="left") for axis in figure.axes]
