"""The part about scaling and its figure follow from their table."""

from fixtures.drawn import texts
from fixtures.material import page

from palpate.studies.scaling import figures


def test_the_finding_names_the_largest_body(scaling_table):
    found = page("scaling", {"scaling": scaling_table})
    assert "A press of 1,000,000 tetrahedra takes 20 s and 5 GB on one core" in found
    assert "with the number of elements to the power of 1.07" in found and "2 cores are 2 times as fast as one" in found
    alone = scaling_table[(scaling_table["component"] != "cores") | (scaling_table["size"] == 1)]
    assert "there is one core only" in page("scaling", {"scaling": alone})


def test_each_component_has_a_panel_with_exponents(scaling_table):
    figure = figures.draw_scaling(scaling_table)
    titles = [axis.get_title(loc="left") for axis in figure.axes if axis.lines]
    assert titles == [*(title for title, _, _ in figures.COMPONENTS.values()), "memory"]
    assert texts(figure).count("respond: n$^{1.07}$") == len(figures.COMPONENTS)
    figure = figures.draw_scaling(scaling_table[scaling_table["component"] != "samples"])
    assert "enrichment, samples" not in [axis.get_title(loc="left") for axis in figure.axes]
