"""Sessions are compared where both pressed, and what contradicts is not averaged."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.pressed_layer import Layer, draw_presses

from palpate.identification.presses import PressRecords
from palpate.identification.sessions import compare_sessions, consistent_parts


def both(factor, named=True):
    rng = np.random.default_rng(0)
    early = draw_presses(Layer(0.004), {}, rng, session="early", place_scatter=0.05)
    late = draw_presses(Layer(0.004), {}, rng, factor * 2000.0, session="late", place_scatter=0.05)
    presses = [*early.presses, *late.presses]
    if not named:
        presses = [replace(press, place="") for press in presses]
    return PressRecords(early.instrument, tuple(presses), "both")


@pytest.mark.parametrize("named", [True, False])
def test_sessions_whose_forces_differ_at_matched_places_contradict(named):
    records = both(2.7, named)
    (found,) = compare_sessions(records)
    assert found.places == 20 and found.contradicts
    assert found.ratio == pytest.approx(2.7, rel=0.1)
    for name, part in consistent_parts(records, [found]):
        assert {press.session for press in part.presses} == {name} and name in ("early", "late")


def test_sessions_that_agree_are_fitted_together():
    records = both(1.0)
    (found,) = compare_sessions(records)
    assert not found.contradicts
    assert [(name, len(part.presses)) for name, part in consistent_parts(records, [found])] == [("all", 40)]
