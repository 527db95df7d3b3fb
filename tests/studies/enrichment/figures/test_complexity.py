"""Fitted exponents are drawn and saved."""

from palpate.report import style
from palpate.studies.enrichment.figures import complexity


def test_exponents_are_drawn(results, tmp_path):
    style.save(complexity.draw(results["complexity"]), tmp_path / "complexity")
