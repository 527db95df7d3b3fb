"""Times of a deformation are drawn beside the paper's."""

from palpate.report import style
from palpate.studies.enrichment.figures import charts


def test_timing_bars_has_two_bars_only_where_the_paper_has_a_number(results):
    liver, own = charts.draw_timing_bars(results["enrichment_timing"]).axes
    assert (len(liver.patches), len(own.patches)) == (5 + 3, 5)


def test_two_drawings_of_one_table_are_the_same_bytes(results, tmp_path):
    for name in "ab":
        style.save(charts.draw_timing_bars(results["enrichment_timing"]), tmp_path / name)
    for suffix in ("png", "svg"):
        assert (tmp_path / f"a.{suffix}").read_bytes() == (tmp_path / f"b.{suffix}").read_bytes()
