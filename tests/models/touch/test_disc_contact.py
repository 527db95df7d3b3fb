"""Contact in linear responses: its complementarity problem, and discs against a body of known answers."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from fixtures.touched_pad import *  # noqa: F403
from fixtures.touched_pad import DEEPEST
from scipy.spatial.transform import Rotation

from palpate.benchmark.touch import Touch, TouchCase, TouchDoubted
from palpate.effects.instrument import Instrument, upright
from palpate.models.touch import disc_contact, linear
from palpate.models.touch.disc_contact import OFF, complementary, settle_discs
from palpate.models.touch.linear import surface_spins


def enumerated(matrix, right):
    """Try every choice of what bears."""
    for bears in product([False, True], repeat=len(right)):
        on, z = np.flatnonzero(bears), np.zeros(len(right))
        z[on] = np.linalg.solve(matrix[np.ix_(on, on)], -right[on])
        if (z >= 0.0).all() and (matrix @ z + right >= -1e-12).all():
            return z
    raise AssertionError("no solution")


@pytest.mark.parametrize("blocks", [5, -1])
def test_what_bears_is_what_trying_all_finds(monkeypatch, blocks):
    """Of matrices that are not symmetric, as gaps close along other ways than discs press; also one by one."""
    rng = np.random.default_rng(3)
    monkeypatch.setattr(disc_contact, "BLOCKS", blocks)
    solve = complementary if blocks == disc_contact.BLOCKS == 5 else complementary.py_func
    for _ in range(40):
        square = rng.normal(size=(7, 7))
        matrix = square @ square.T + 0.1 * np.eye(7) + 0.2 * (square - square.T)
        right = rng.normal(size=7)
        found, solved = solve(matrix, right, 200)
        assert solved
        np.testing.assert_allclose(found, enumerated(matrix, right), atol=1e-9)


def test_independent_discs_yield_by_what_overlaps():
    """Springs that know nothing of each other under a ball: each is pressed until it is at the ball's surface."""
    radius, depth, compliance = 0.01, 0.003, 2.0
    across = np.linspace(-0.012, 0.012, 13)
    rest = np.array([[x, 0.0, 0.0] for x in across])
    motions = np.zeros((13, 13, 3))
    motions[np.arange(13), np.arange(13), 2] = -compliance
    ball = upright(Instrument("sphere", radius), np.zeros(3), np.array([0.0, 0.0, 1.0]))
    way = np.array([0.0, 0.0, -depth])
    still = np.zeros((0, 13, 3))
    forces, off = settle_discs(rest, motions, still, np.eye(13), ball.tip, way, 2, ball.axes, ball.instrument.shape)
    surface = radius - depth - np.sqrt(np.maximum(radius**2 - across**2, 0.0))
    expected = np.where(np.abs(across) < radius, np.maximum(-surface, 0.0), 0.0) / compliance
    assert off <= OFF
    np.testing.assert_allclose(forces, expected, atol=OFF * depth / compliance)
    assert (forces > 0.0).sum() == 7


def test_turned_discs_bear_where_they_touch():
    """Gaps are worked out anew, each motion turned by rotations by many small parts of its vector, and their mean."""
    rng = np.random.default_rng(5)
    rest = np.column_stack([rng.uniform(-0.008, 0.008, (40, 2)), np.zeros(40)])
    apart = np.linalg.norm(rest[:, None] - rest[::4], axis=2)
    motions, spins = np.zeros((10, 40, 3)), np.zeros((10, 40, 3))
    motions[:, :, 2] = -1.0 / (1.0 + apart.T / 0.003)
    spins[:, :, 1] = 150.0 * motions[:, :, 2] * np.tanh((rest[:, 0] - rest[::4, :1]) / 0.003)
    shares = np.maximum(1.0 - (apart.T / 0.004) ** 2, 0.0)
    shares = np.ascontiguousarray(shares / shares.sum(axis=1, keepdims=True))
    ball, way = upright(Instrument("sphere", 0.01), np.zeros(3), np.array([0.0, 0.0, 1.0])), np.array([0, 0, -0.004])
    forces, _ = settle_discs(rest, motions, spins, shares, ball.tip, way, 1, ball.axes, ball.instrument.shape)
    moved, spin = np.tensordot(forces, motions, 1), np.tensordot(forces, spins, 1)
    parts = (np.arange(400) + 0.5) / 400
    turned = np.mean([Rotation.from_rotvec(t * spin).apply(moved) for t in parts], axis=0)
    means = shares @ ball.moved(way).gaps(rest + turned)[0]
    assert (forces >= 0.0).all() and 2 < (forces > 0.0).sum() < 10
    assert np.abs(spin).max() > 0.2
    assert np.abs(means[forces > 0.0]).max() < 1.1 * OFF * 0.004 and means.min() > -1.1 * OFF * 0.004


def test_a_small_rotation_is_its_own_spin(pad):
    vectors = np.array([[0.01, 0.0, 0.0], [0.0, -0.02, 0.01]])
    fields = np.stack([np.cross(vector, pad.fine.nodes) for vector in vectors], axis=2)
    found = surface_spins(pad.fine, fields)
    np.testing.assert_allclose(
        found[pad.fine.surface], np.broadcast_to(vectors.T, (len(pad.fine.surface), 3, 2)), atol=1e-15
    )


@pytest.mark.parametrize(
    "instrument",
    [
        Instrument("punch", 0.015, 0.003),
        Instrument("punch", 0.015),
        Instrument("capsule", 0.01, length_m=0.02),
        Instrument("sphere", 0.02),
    ],
    ids=["punch", "sharp punch", "capsule", "sphere"],
)
@pytest.mark.parametrize(("tilt", "warped"), [(0.0, False), (0.5, True)], ids=["linear", "tilted and warped"])
def test_any_instrument_is_felt_more_the_deeper_it_is(pad, middle, instrument, tilt, warped):
    case = TouchCase(pad, instrument, DEEPEST, 1)
    solver = linear.online(case, discs=30, held=0, level=2, warped=warped)
    way = np.array([np.sin(tilt), 0.0, -np.cos(tilt)])
    touches = [Touch(instrument, middle, way, depth) for depth in (0.002, 0.004, 0.006)]
    solver.prepare(touches[0])
    found = [solver.respond(touch) for touch in touches]
    forces, areas = [each.force_n for each in found], [each.area_m2 for each in found]
    assert 0.0 < forces[0] < forces[1] < forces[2]
    assert 0.0 < areas[0] <= areas[2] < np.pi * 0.04**2


def test_contact_that_is_not_solved_is_doubted(touch_case, touches, monkeypatch):
    solver = linear.online(touch_case, discs=20, held=0, level=2, warped=False)
    solver.prepare(touches[0])
    solver.respond(touches[0])
    monkeypatch.setattr(linear, "OFF", 1e-15)
    with pytest.raises(TouchDoubted, match="gaps"):
        solver.respond(touches[0])


def test_what_is_smaller_than_a_disc_is_doubted(touch_case, touches):
    solver = linear.online(touch_case, discs=20, held=0, level=2, warped=False)
    solver.prepare(touches[0])
    with pytest.raises(TouchDoubted, match="more discs"):
        solver.respond(replace(touches[0], depth_m=1e-5))
