"""Scaling is drawn with its exponents."""

import matplotlib.text

from palpate.report import style
from palpate.studies.scaling import figures


def test_each_component_has_a_panel_with_exponents(scaling_table, tmp_path):
    figure = figures.draw_scaling(scaling_table)
    titles = [axis.get_title(loc="left") for axis in figure.axes if axis.lines]
    assert titles == [*(title for title, _, _ in figures.COMPONENTS.values()), "memory"]
    texts = [t.get_text() for t in figure.findobj(matplotlib.text.Text)]
    assert texts.count("respond: n$^{1.07}$") == len(figures.COMPONENTS)
    style.save(figure, tmp_path / "scaling")


def test_a_component_may_be_missing(scaling_table):
    figure = figures.draw_scaling(scaling_table[scaling_table["component"] != "samples"])
    assert "enrichment, samples" not in [axis.get_title(loc="left") for axis in figure.axes]
