"""Frequency, damping and creep of a made-up oscillation are recovered."""

import numpy as np
import pytest

from palpate.errors import InputError
from palpate.studies.measured.records import fit_oscillation


def made_up(t, hz=7.74, ratio=0.052, creep=6e-4, noise=0.0):
    omega = 2 * np.pi * hz
    swing = 5e-3 * np.exp(-ratio * omega * t) * np.cos(omega * np.sqrt(1 - ratio**2) * t + 0.3)
    return 6.5e-3 - creep * np.exp(-t / 0.55) + swing + np.random.default_rng(0).normal(0.0, noise, len(t))


@pytest.mark.parametrize(("hz", "ratio"), [(7.74, 0.052), (4.34, 0.02), (2.0, 0.2)])
def test_it_is_recovered(hz, ratio):
    t = np.arange(0.0, 4.0, 0.01)
    found = fit_oscillation(t, made_up(t, hz, ratio), "made up")
    assert found.frequency_hz == pytest.approx(hz, rel=1e-6) and found.damping_ratio == pytest.approx(ratio, rel=1e-6)
    before = np.exp(0.5 / hz / 0.55)  # it was let go half a swing before
    assert found.creep_m == pytest.approx(6e-4 * before, rel=1e-3) and found.creep_s == pytest.approx(0.55, rel=1e-3)


def test_noise_of_a_camera_and_a_gap_hardly_matter():
    t = np.arange(0.0, 4.0, 0.01)
    t = t[(t < 1.8) | (t > 3.0)]
    found = fit_oscillation(t, made_up(t, noise=1e-5), "made up")
    assert found.frequency_hz == pytest.approx(7.74, rel=1e-3) and found.damping_ratio == pytest.approx(0.052, rel=5e-3)


def test_the_decrement_of_free_swings_is_recovered():
    t = np.arange(0.0, 1.0, 0.002)
    found = fit_oscillation(t, made_up(t, creep=0.0), "made up", creeps=False)
    peaks = 5e-3 * np.exp(-2 * np.pi * found.damping_ratio / np.sqrt(1 - found.damping_ratio**2))
    assert np.log(5e-3 / peaks) == pytest.approx(2 * np.pi * 0.052 / np.sqrt(1 - 0.052**2), rel=1e-3)
    assert found.creep_m == 0.0


def test_what_does_not_swing_is_refused():
    t = np.arange(0.0, 2.0, 0.01)
    with pytest.raises(InputError, match="made up shows no damped oscillation after the release; set swings: false"):
        fit_oscillation(t, np.random.default_rng(0).normal(size=len(t)), "made up")
    with pytest.raises(InputError, match="made up has 5 rows after the release"):
        fit_oscillation(t[:5], t[:5], "made up")
