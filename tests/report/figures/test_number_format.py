"""Formats of numbers in sentences."""

import numpy as np
import pytest

from palpate.report import words


@pytest.mark.parametrize(
    ("share", "text"),
    [(0.35, "35 %"), (0.0057, "0.57 %"), (0.02, "2 %"), (1.234, "123 %"), (np.nan, "failed"), (0.0, "0 %"),
     (2e-9, "< 0.001 %")],
)  # fmt: skip
def test_percent(share, text):
    assert words.percent(share).replace("\u00a0", " ") == text


@pytest.mark.parametrize(
    ("value", "text"), [(49.292, "49.3 s"), (0.128, "128 ms"), (9e-5, "90 µs"), (1.0, "1 s"), (1234.0, "1230 s")]
)
def test_seconds(value, text):
    assert words.seconds(value).replace("\u00a0", " ") == text
