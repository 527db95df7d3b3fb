"""Sentences about models in motion follow from their table."""

from pathlib import Path

from palpate.report import page as report
from palpate.report.parts import dynamic_numbers

CAPTIONS = Path(__file__).parents[3] / "workflow" / "report"


def test_the_headline_is_about_what_keeps_up_with_life(dynamic_table):
    said = dynamic_numbers.numbers({"dynamic_accuracy": dynamic_table})["headline_dynamic"].replace("\u00a0", " ")
    assert said.count("(4 % of the peak off)") == 2
    slow = dynamic_table.assign(real_time_factor=2.0)
    assert dynamic_numbers.numbers({"dynamic_accuracy": slow})["headline_dynamic"].endswith("press none; bar sag none.")


def test_the_report_has_both_beside_the_other_comparisons(dynamic_table, tmp_path):
    (tmp_path / "tables").mkdir()
    (tmp_path / "figures").mkdir()
    dynamic_table.to_csv(tmp_path / "tables/dynamic_accuracy.csv", index=False)
    for suffix in ("svg", "png"):
        (tmp_path / f"figures/dynamic_accuracy.{suffix}").write_text("<svg></svg>")
    report.write(tmp_path, CAPTIONS, tmp_path / "report.html", ["dynamic"], [], [])
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert '<figure id="dynamic_accuracy">' in page and 'class="finding">Least wrong' in page
