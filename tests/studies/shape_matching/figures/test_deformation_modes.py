"""There is a block for each mode and deformation, and it says how much is missed."""

from palpate.studies.shape_matching import figures


def test_each_block_says_what_its_mode_misses(shape_matching_results):
    table = shape_matching_results["deformation_modes"]
    figure = figures.draw_deformation_modes(table)
    said = [[text.get_text() for text in axis.texts if "misses" in text.get_text() or text.get_text() == "follows"]
            for axis in figure.axes]  # fmt: skip
    assert [text for (text,) in said] == ["misses 90\u00a0%"] * 2 + ["follows", "misses 50\u00a0%"] + ["follows"] * 2
    assert [axis.get_title(loc="left") for axis in figure.axes[:2]] == ["linear", "bent"]
