"""A Prony series: its modulus over time, and the exact update of a step, against integrals and known limits."""

import numpy as np
import pytest
from scipy.integrate import quad

from palpate.bodies.material import Series, prony_fault

SERIES = Series([0.3, 0.2], [0.1, 2.0])


def test_the_modulus_falls_from_its_first_value_to_its_last():
    assert SERIES.modulus(0.0) == pytest.approx(1 / (1 - 0.5), rel=1e-14)
    assert SERIES.modulus(1e9) == pytest.approx(1.0, rel=1e-14)
    t = np.linspace(0.0, 3.0, 50)
    of_first = 1.0 - 0.3 * (1 - np.exp(-t / 0.1)) - 0.2 * (1 - np.exp(-t / 2.0))
    assert SERIES.modulus(t) == pytest.approx(of_first / 0.5, rel=1e-13)


@pytest.mark.parametrize("h", [1e-4, 0.05, 1.0, 30.0])
def test_a_step_is_the_integral_over_an_even_change_of_strain(h):
    a, b = SERIES.factors(h)
    for tau, kept, gained in zip(SERIES.times_s, a, b, strict=True):
        memory, _ = quad(lambda t, tau=tau: np.exp(-(h - t) / tau) / h, 0.0, h, points=[max(0.0, h - 20 * tau)])
        assert gained == pytest.approx(memory, rel=1e-9)
        assert kept == pytest.approx(np.exp(-h / tau), rel=1e-14)


@pytest.mark.parametrize("span", [0.0, 1e-300, 1e-17, 1e-9, 1e-3, 1.0, 50.0, 1e3, 1e12, 1e300])
def test_a_branch_takes_energy_from_every_step(span):
    """a ≤ b ≤ 1 makes both parts of the argument in Prony hold: a² / b ≤ 1 before, and b ≤ 1 after."""
    (a,), (b,) = Series([0.5], [1.0]).factors(span)
    assert 0.0 <= a <= b <= 1.0
    assert b > 0.0 and (span < 1e3 or b == pytest.approx(1.0 / span, rel=1e-12))


@pytest.mark.parametrize(
    ("shares", "times", "said"),
    [
        ([0.5], [1.0, 2.0], "shares has 1 numbers and times_s 2; give one"),
        ([], [], "shares has 0 numbers and times_s 0; give one"),
        ([0.5, -0.1], [1.0, 2.0], "shares has -0.1; give numbers above 0"),
        ([0.5, 0.495], [1.0, 2.0], "shares has the sum 0.995, of which 0.99 is the most"),
        ([float("nan")], [1.0], "shares has nan"),
        ([0.5], [0.0], "times_s has 0; give times"),
        ([0.5], [float("inf")], "times_s has inf; give times"),
    ],
)
def test_a_series_that_is_none_is_refused(shares, times, said):
    assert prony_fault({"shares": shares, "times_s": times}).startswith(said)


def test_shares_up_to_the_most_are_taken():
    assert prony_fault({"shares": [0.33, 0.33, 0.33], "times_s": [1, 2, 3]}) == ""
