"""Branches are recovered from presses whose loading takes longer than the fastest of them."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.bodies.material import Series
from palpate.errors import InputError
from palpate.identification.hereditary import Branches, Fading
from palpate.identification.presses import Press
from palpate.identification.relaxation import (
    draw_branches,
    fit_branches,
    fit_fading,
    hold_of,
    noise_of,
    relaxed,
)  # fmt: skip

TRUE = Branches(Series([0.3, 0.25], [0.3, 4.0]))


def pressed(kernel=TRUE, deepest=0.003, speed=0.0015, noise=0.0, seed=0, specimen=""):
    """A press to ``deepest`` [m] by an instantaneous force that no power of depth has, and 8 s at that depth."""
    loading = deepest / speed
    fine = np.linspace(0.0, loading + 8.0, round((loading + 8.0) / 0.005) + 1)
    depth = np.minimum(speed * fine, deepest)
    force = kernel.respond(fine, (depth**1.5 * np.exp(depth / 0.002))[:, None])[:, 0]
    force *= 1.0 + noise * np.random.default_rng(seed).normal(size=len(fine))
    return Press(f"p{seed}", "", "", specimen, None, None, fine[::20], depth[::20], force[::20])


def test_branches_follow_from_the_loading_and_the_hold():
    holds = [hold_of(pressed(deepest=deepest)) for deepest in (0.0024, 0.003)]
    found = fit_branches(holds, 2)
    assert found.series.shares == pytest.approx(TRUE.series.shares, rel=0.01)
    assert found.series.times_s == pytest.approx(TRUE.series.times_s, rel=0.02)
    assert max(np.abs(hold.error(found)).max() for hold in holds) < 1e-3


def test_a_power_of_time_is_recovered():
    true = Fading(0.25, 0.05)
    found = fit_fading([hold_of(pressed(true))], 1.0)
    assert (found.exponent, found.time_s) == pytest.approx((0.25, 0.05), rel=0.1)


def test_a_relaxed_press_has_the_relaxed_force():
    press = pressed()
    late = relaxed(hold_of(press), TRUE)
    assert len(late.depth_m) == 21 and late.depth_m[-1] == press.depth_m[-1]
    wanted = 0.45 * late.depth_m**1.5 * np.exp(late.depth_m / 0.002)
    assert late.force_n[3:] == pytest.approx(wanted[3:], rel=0.01)


def test_errors_with_a_memory_are_recovered():
    rng, times = np.random.default_rng(2), np.arange(4000) * 0.1
    error = np.zeros(4000)
    for k in range(1, 4000):
        error[k] = np.exp(-0.1 / 0.5) * error[k - 1] + 0.02 * np.sqrt(1 - np.exp(-0.4)) * rng.normal()
    noise = noise_of(error, times)
    assert (noise.scatter, noise.memory_s) == pytest.approx((0.02, 0.5), rel=0.15)


def test_intervals_hold_the_truth():
    """Nine in ten, of 24 numbers of 8 sets of presses with errors of 2 %; by chance, fewer than 17 are rare."""
    held = 0
    for seed in range(8):
        holds = [hold_of(pressed(deepest=0.0024 + 0.0002 * k, noise=0.02, seed=10 * seed + k)) for k in range(3)]
        found = fit_branches(holds, 2)
        draws = draw_branches(holds, found, 20, np.random.default_rng(seed))
        assert draws.drawn == "errors"
        low, high = draws.interval(lambda one: np.array([*one.series.shares, one.series.times_s[1]]))
        true = np.array([*TRUE.series.shares, TRUE.series.times_s[1]])
        held += int(((low <= true) & (true <= high)).sum())
    assert held >= 17


def test_what_is_not_held_is_refused():
    press = pressed()
    moving = replace(press, depth_m=np.linspace(0.0, 0.003, len(press.depth_m)))
    for wrong, words in ((moving, "is at its last depth"), (replace(press, time_s=None), "has no times")):
        with pytest.raises(InputError, match=words):
            hold_of(wrong)
