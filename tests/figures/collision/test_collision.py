"""The pictures and sentences about collision say what their tables say."""

import pytest

from palpate.errors import InputError
from palpate.figures import style
from palpate.figures.collision import collision, collision_looks, collision_scaling
from palpate.report.numbers import numbers

PUBLISHED = {"collision": {"source": "thesis"}}


def test_time_over_false_pairs_has_a_curve_a_structure_and_a_line_a_rival(collision_results):
    figure = collision.draw(collision_results["collision"])
    above = figure.axes[:2]
    assert [axis.get_title("left").split(",")[0] for axis in above] == ["two livers", "folding sheet"]
    drawn = {line.get_color(): line for line in above[0].lines}
    for depths, false, query in (("4/2", 100.0, 2.0), ("8/4", 400.0, 4.0)):
        composite = drawn[collision_looks.look("composite", depths, ["4/2", "8/4"]).colour]
        assert (composite.get_xdata()[0], composite.get_ydata()[0]) == (false, query)
    joined = drawn[style.FAINT]
    assert list(joined.get_xdata()) == [100.0, 400.0]
    assert drawn[collision_looks.look("obb_coal").colour].get_ydata()[0] == 2.0
    assert len(above[0].lines) == len(above[1].lines) + 1


def test_frames_have_a_row_each(collision_results):
    figure = collision.draw(collision_results["collision"])
    labels = [text.get_text() for text in figure.axes[2].get_yticklabels()]
    assert labels == ["spheres", "AABBs", "composite 4/2", "composite 8/4", "coal, OBBs, rebuilt"]
    whole = [line.get_xdata()[0] for line in figure.axes[2].lines[2::3]]
    assert whole == [4.5, 1.5, 2.5, 4.5, 12.0]


def test_growth_has_a_panel_a_stage_and_names_exponents(collision_results):
    figure = collision_scaling.draw(collision_results["collision_scaling"])
    assert [axis.get_title("left") for axis in figure.axes] == ["build", "refit", "query"]
    labels = [[text.get_text() for text in axis.get_legend().get_texts()] for axis in figure.axes]
    assert "AABBs: n$^{1.00}$" in labels[1] and "composite 4/2: n$^{0.50}$" in labels[2]
    assert not any("coal" in label for label in labels[1])


def test_sentences_come_from_the_tables(collision_results):
    found = numbers(collision_results, PUBLISHED, ["collision"], [])
    found = {name: text.replace("\u00a0", " ") for name, text in found.items()}
    assert found["collision_missed"] == "0 pairs missed or made up in 1,600 frames"
    assert found["collision_fastest"] == "two_livers: AABBs, 1.5 ms; folding_sheet: AABBs, 1.5 ms"
    assert found["collision_rivals"] == "coal, OBBs, rebuilt: two livers 8.0"
    assert found["collision_wrong"] == "coal, OBBs, rebuilt 7 missed and 3 made up"
    assert found["collision_exponents"] == "build n^1.00 to n^1.00, refit n^1.00 to n^1.00, query n^0.50 to n^0.50"
    # 2.5 ms against 1.5 ms
    assert found["collision_plain"] == "composite 4/2 takes 1.67 times as long"
    assert found["collision_verdicts"] == "query time confirmed in 1 of 1 rows"
    assert "takes 1.5 ms on one core with AABBs (coal, OBBs, rebuilt: 12 ms)." in found["headline_collision"]


def test_without_rivals_nothing_is_said_of_them(collision_results):
    table = collision_results["collision"]
    found = numbers(collision_results | {"collision": table[~table["rival"]]}, PUBLISHED, ["collision"], [])
    assert found["headline_collision"].endswith("on one core with AABBs.")
    assert found["collision_rivals"] == "none is installed"


def test_an_unknown_structure_has_no_colour(collision_results):
    with pytest.raises(InputError, match="structure cone has no colour"):
        collision_looks.look("cone")
    table = collision_results["collision"].replace({"structure": {"aabb": "cone"}})
    with pytest.raises(InputError, match="structure cone has no colour"):
        collision.draw(table)
