"""The likelihood of presses is that of a normal distribution where it is one, and an integral elsewhere."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import multivariate_normal, norm

from palpate.identification.mixed_effects import Layout, Spread, modes

DEPTH = np.linspace(0.2, 1.0, 6)
START, STEP, COUNT = np.log(1e-3), np.log(2e3) / 40, 41
LOGS = (1.5 * (START + STEP * np.arange(COUNT)))[None]
SLOPES = np.full((1, COUNT), 1.5)
"""Forces d^1.5, on which a table is exact."""


def layout_of(force, presses, places):
    count = len(force) // presses
    starts = np.arange(0, places + 1) * (presses // places)
    level = np.log(np.tile(DEPTH[:count], presses) / 0.5)
    press_start = count * np.arange(presses + 1)
    table = np.zeros(presses, dtype=np.int64)
    return Layout(np.tile(DEPTH[:count], presses), force, level, np.ones(len(force)), press_start, starts, table)


def test_without_offsets_and_floor_log_forces_of_a_place_are_normal():
    rng = np.random.default_rng(2)
    spread = Spread(0.05, 1e-9, 0.3, 0.2, 0.1, 0.0, 0.0, 0.07)
    force = 3.0 * np.exp(0.4 * rng.standard_normal(4 * len(DEPTH)))
    layout = layout_of(force, 4, 2)  # two places, two presses each
    found = modes(layout, LOGS, SLOPES, START, STEP, np.log(2.0), spread).minus2
    same = np.kron(np.eye(2), np.ones((len(DEPTH), len(DEPTH))))
    level = layout.level[: 2 * len(DEPTH)]
    cov = 0.3**2 + 0.2**2 * np.outer(level, level) + 0.1**2 * same + 0.05**2 * np.eye(2 * len(DEPTH))
    mean = np.log(2.0) + 1.5 * np.log(layout.depth_m[: 2 * len(DEPTH)]) + 0.07 * level
    for place in range(2):
        log_f = np.log(force.reshape(2, -1)[place])
        expected = -2 * multivariate_normal(mean, cov).logpdf(log_f) + 2 * log_f.sum() - len(log_f) * np.log(2 * np.pi)
        assert found[place] == pytest.approx(expected, rel=1e-6)


def test_the_integral_over_an_offset_is_nearly_that_by_quadrature():
    spread = Spread(0.05, 0.02, 0.0, 0.0, 0.0, 0.01, 0.02, 0.0)
    force = 2.0 * (DEPTH - 0.03) ** 1.5 * np.array([1.02, 0.97, 1.05, 1.0, 0.98, 1.01])
    found = modes(layout_of(force, 1, 1), LOGS, SLOPES, START, STEP, np.log(2.0), spread).minus2[0]

    def likelihood(offset):
        seen, meant = np.arcsinh(force / 0.02), np.arcsinh(2.0 * (DEPTH - offset) ** 1.5 / 0.02)
        log = -0.5 * (((seen - meant) / 0.05) ** 2 + 2 * np.log(0.05) + np.log(force**2 + 0.02**2)).sum()
        return np.exp(log) * norm.pdf(offset, 0.01, 0.02)

    assert found == pytest.approx(-2 * np.log(quad(likelihood, -0.1, 0.12)[0]), abs=0.02)


def test_points_without_weight_are_predicted_by_the_effects_of_the_others():
    spread = Spread(0.01, 1e-9, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0)
    force = 6.0 * DEPTH**1.5
    layout = layout_of(np.concatenate([force, force]), 2, 2)
    weight = np.array([1.0, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0])
    found = modes(layout._replace(weight=weight), LOGS, SLOPES, START, STEP, np.log(2.0), spread)
    predicted = np.exp(found.log_force)
    assert predicted[:6] == pytest.approx(force, rel=1e-3)  # drawn to the typical place, by a hair
    assert predicted[6:] == pytest.approx(2.0 * DEPTH**1.5)
    assert found.minus2[1] == pytest.approx(0.0)
