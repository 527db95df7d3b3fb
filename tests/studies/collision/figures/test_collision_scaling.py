"""Growth of bounding structures is drawn with its exponents."""

from palpate.studies.collision import figures


def test_growth_has_a_panel_a_stage_and_names_exponents(collision_results):
    figure = figures.draw_collision_scaling(collision_results["collision_scaling"])
    assert [axis.get_title("left") for axis in figure.axes] == ["build", "refit", "query"]
    labels = [[text.get_text() for text in axis.get_legend().get_texts()] for axis in figure.axes]
    assert "AABBs: n$^{1.00}$" in labels[1] and "composite 4/2: n$^{0.50}$" in labels[2]
    assert not any("coal" in label for label in labels[1])
