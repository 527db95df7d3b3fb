"""Fitted exponents are drawn and saved."""

from palpate.figures import style
from palpate.figures.enrichment import complexity


def test_exponents_are_drawn(results, tmp_path):
    style.save(complexity.draw(results["complexity"]), tmp_path / "complexity")
