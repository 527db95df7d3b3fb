"""Lagged friction: its derivatives, its normal forces and its limit."""

import numpy as np
import pytest

from palpate.collision.contact import barrier
from palpate.collision.contact.barrier import thresholds
from palpate.collision.contact.friction import LaggedFriction

SLIP = 0.02


@pytest.fixture(scope="module")
def contacts():
    """Make thirty stencils of both kinds at x, some of which are too far apart to act."""
    x = np.random.default_rng(1).normal(size=(120, 3))
    kinds, nodes = np.arange(30) % 2, np.arange(120).reshape(-1, 4)
    arguments = kinds, nodes, np.zeros(30), np.linspace(1.0, 2.0, 30), thresholds(kinds, nodes, x), 1.2
    return arguments, x


def lagged(contacts, coefficient=0.4):
    arguments, x = contacts
    return LaggedFriction(arguments, x, coefficient, SLIP, x)


@pytest.mark.parametrize("amount", [0.1, 0.5, 1.0, 30.0])
def test_force_and_blocks_are_derivatives(contacts, amount):
    state, x = lagged(contacts), contacts[1]
    assert 10 < len(state.rows) < 30
    y = x + amount * SLIP * np.random.default_rng(2).normal(size=x.shape)
    force = np.zeros_like(x)
    state.add_force(y, force)
    nodes, blocks = state.blocks(y, False)
    step = 1e-4 * SLIP
    for k, row in enumerate(nodes):
        hessian = blocks[k].transpose(0, 2, 1, 3).reshape(12, 12)
        assert np.linalg.eigvalsh(hessian).min() > -1e-12 * np.abs(hessian).max()
        for i, (node, axis) in enumerate(zip(np.repeat(row, 3), 4 * [0, 1, 2], strict=True)):
            delta = np.zeros_like(x)
            delta[node, axis] = step
            slope = (state.energy(y + delta) - state.energy(y - delta)) / (2.0 * step)
            assert abs(force[node, axis] + slope) < 1e-6 * np.abs(force).max()
            change = np.zeros_like(x), np.zeros_like(x)
            state.add_force(y - delta, change[0])
            state.add_force(y + delta, change[1])
            slope = (change[0] - change[1])[row].ravel() / (2.0 * step)
            assert np.abs(hessian[i] - slope).max() < 1e-5 * np.abs(hessian).max()


def test_definite_blocks_are_of_a_parabola_that_is_nowhere_below_the_energy(contacts):
    state, x, rng = lagged(contacts), contacts[1], np.random.default_rng(5)
    for amount, reach in ((0.1, 5.0), (1.0, 1.0), (30.0, 30.0), (30.0, 1.0)):
        y = x + amount * SLIP * rng.normal(size=x.shape)
        step, force = reach * SLIP * rng.normal(size=x.shape), np.zeros_like(x)
        state.add_force(y, force)
        nodes, blocks = state.blocks(y, True)
        bent = 0.5 * np.einsum("kai,kabij,kbj->", step[nodes], blocks, step[nodes])
        assert bent >= 0.5 * np.einsum("kai,kabij,kbj->", step[nodes], state.blocks(y, False)[1], step[nodes]) >= 0.0
        assert state.energy(y + step) <= state.energy(y) - np.vdot(force, step) + bent


def test_normal_forces_are_the_barriers(contacts):
    arguments, x = contacts
    kinds, nodes, offsets, scales, _, gap = arguments
    unmollified = kinds, nodes, offsets, scales, np.zeros(30), gap
    state, force = LaggedFriction(unmollified, x, 0.4, SLIP, x), np.zeros_like(x)
    barrier.add_force(*unmollified, x, force)
    for row, weights, normal, push in zip(state.nodes, state.weights, state.normals, state.forces, strict=True):
        assert np.abs(force[row] - push * np.outer(weights, normal)).max() < 1e-12 * push
    assert np.array_equal(state.limits, 0.4 * state.forces)


def test_nothing_at_rest_and_along_the_normal_and_the_limit_beyond_slip(contacts):
    state, x = lagged(contacts), contacts[1]
    assert state.energy(x) == 0.0
    for way, expected in ((1.0, 0.0), (0.0, 1.0)):
        for k, row in enumerate(state.nodes):
            aside, weights = np.cross(state.normals[k], [0.3, -0.5, 0.8]), state.weights[k]
            direction = way * state.normals[k] + (1.0 - way) * aside / np.linalg.norm(aside)
            moved, force = x.copy(), np.zeros_like(x)
            moved[row] += 3.0 * SLIP * np.outer(weights / (weights @ weights), direction)
            state.add_force(moved, force)
            size = np.linalg.norm(force[row]) / np.linalg.norm(weights)
            assert abs(size - expected * state.limits[k]) < 1e-9 * state.limits[k]


def test_friction_takes_energy_out_and_is_symmetric_in_the_two_parts(contacts):
    state, x = lagged(contacts), contacts[1]
    y, force = x + SLIP * np.random.default_rng(4).normal(size=x.shape), np.zeros_like(x)
    state.add_force(y, force)
    assert np.vdot(force, y - x) < 0.0
    assert np.abs(force.sum(axis=0)).max() < 1e-13 * np.abs(force).sum()
