"""Modes of answers: orthonormal in the stiffness, with as much energy as so many can hold."""

import numpy as np
import pytest

from palpate.models.contact_modes.elements_at_rest import ElementsAtRest
from palpate.models.pod_galerkin import energy_pod


@pytest.fixture(scope="module")
def answers(slab):
    elements = ElementsAtRest(slab, 0, 1)
    loads = np.random.default_rng(0).normal(size=(len(elements.rest), 3, 6)) * [3.0, 1.0, 1.0, 1.0, 0.1, 0.1]
    return elements, list(np.moveaxis(elements.solve(loads, 1e-10), 2, 0))


def stiff(elements, moved):
    return elements.multiply(np.ascontiguousarray(moved))


def test_modes_are_orthonormal_and_hold_the_answers(answers):
    elements, shown = answers
    mixes, coordinates = energy_pod(elements, shown, 6)
    modes = np.tensordot(shown, mixes, (0, 0))
    products = [[float(np.vdot(modes[..., i], stiff(elements, modes[..., j]))) for j in range(6)] for i in range(6)]
    assert products == pytest.approx(np.eye(6), abs=1e-8)
    assert modes @ coordinates == pytest.approx(np.moveaxis(shown, 0, 2), abs=1e-8 * np.abs(shown).max())


def test_fewer_modes_hold_what_they_can_and_twins_make_none(answers):
    elements, shown = answers
    _, coordinates = energy_pod(elements, shown, 2)
    size = [float(np.vdot(moved, stiff(elements, moved))) for moved in shown]
    held = float(np.sum(coordinates**2 / size))
    whole = np.array([[np.vdot(a, stiff(elements, b)) for b in shown] for a in shown]) / np.sqrt(np.outer(size, size))
    assert held == pytest.approx(np.linalg.eigvalsh(whole)[-2:].sum(), rel=1e-8)
    twins, _ = energy_pod(elements, shown + shown, 12)
    assert twins.shape == (12, 6)
