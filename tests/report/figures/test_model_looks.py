"""Every model has a label, a colour and a marker, the user's own included; numbers stand in sentences."""

import numpy as np
import pytest

from palpate.models.model_registry import FAMILY_OF, MODELS, RESERVED
from palpate.report import words
from palpate.report.model_looks import look, minor


def test_every_model_of_palpates_has_a_look_of_its_own():
    names = [name for name in (*MODELS, *RESERVED) if not minor(name)]
    assert len({(look(name).colour, look(name).marker) for name in names}) == len(names)
    assert {name for name in MODELS if minor(name)} == {
        name for name, family in FAMILY_OF.items() if family == "paper_enrichment"
    }


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
