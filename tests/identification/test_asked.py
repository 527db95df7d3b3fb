"""What is asked of presses becomes forward models, with ranges that their curves bear."""

import numpy as np
import pytest

from palpate.effects.instrument import Instrument
from palpate.errors import NotConverged
from palpate.identification import asked
from palpate.identification.asked import MOST_ERROR, Asked, forwards_for, thickness_of
from palpate.identification.forward import SlabForward
from palpate.identification.presses import Press, PressRecords


class Curves:
    """Curves whose error grows with the stiffening, and that end at a stiffening that presses do not bear."""

    per_stiffening, borne = 0.0, np.inf

    def __init__(self, radius_m, deepest_m, law, thickness_m, poisson, stiffening, *more, **others):
        if stiffening[1] > self.borne:
            raise NotConverged("no equilibrium", [1.0])
        self.stiffening, self.relative_error = stiffening, self.per_stiffening * stiffening[1]

    def without_stiffening(self):
        return Curves(0.0, 0.0, "", None, None, (0.0, 0.0))


@pytest.mark.parametrize(
    ("error", "borne", "most"), [(MOST_ERROR / 20.0, np.inf, 20.0), (MOST_ERROR / 5.1, np.inf, 5.0), (0.0, 12.0, 10.0)]
)
def test_stiffening_is_narrowed_to_what_is_borne_and_met(monkeypatch, error, borne, most):
    monkeypatch.setattr(asked, "SlabForward", Curves)
    monkeypatch.setattr(Curves, "per_stiffening", error)
    monkeypatch.setattr(Curves, "borne", borne)
    depth = np.linspace(0.0, 0.001, 5)
    press = Press("one", "", "", "", None, None, None, depth, depth)
    records = PressRecords(Instrument("sphere", 0.004), (press,), "presses.csv")
    question = Asked(Instrument("sphere", 0.004))
    if most == 20.0:
        found = forwards_for(records, question)
    else:
        with pytest.warns(UserWarning, match=f"up to {most:g}"):
            found = forwards_for(records, question)
    assert found["exponential"].stiffening == (0.0, most) and found["neo_hookean"].stiffening == (0.0, 0.0)


def test_the_thickness_of_a_file_counts_for_each_press_unless_another_is_asked_for():
    depth = np.linspace(0.0, 0.001, 5)
    presses = tuple(Press("", "", "", "", None, None, None, depth, depth, thick) for thick in (0.008, 0.006))
    ball, records = Instrument("sphere", 0.004), PressRecords(Instrument("sphere", 0.004), presses, "presses.csv")
    thickness, each = thickness_of(records, Asked(ball))
    assert thickness == (0.006, 0.008) and each.tolist() == [0.008, 0.006]
    assert thickness_of(records, Asked(ball, thickness_m=(0.01, 0.01))) == ((0.01, 0.01), None)
    known = {"poisson": (0.45, 0.45)}
    both = SlabForward(0.004, 0.001, thickness_m=thickness, each_m=each, **known)
    one = SlabForward(0.004, 0.001, thickness_m=(0.006, 0.006), **known)
    assert both.parameters == ()
    assert both.forces(1, depth, {}) == pytest.approx(one.forces(0, depth, {}), rel=0.01)
    assert (both.forces(0, depth[1:], {}) < 0.95 * both.forces(1, depth[1:], {})).all()
