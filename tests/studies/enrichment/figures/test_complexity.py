"""Fitted exponents are drawn and saved."""

from palpate.report import style
from palpate.studies.enrichment.figures import charts


def test_exponents_are_drawn(results, tmp_path):
    style.save(charts.draw_complexity(results["complexity"]), tmp_path / "complexity")
