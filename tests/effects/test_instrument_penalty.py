"""Nodes that an instrument pushes out: the force is the energy's, and only nodes inside feel it."""

import numpy as np
import pytest

from palpate.bodies.simple_shapes import box
from palpate.effects.instrument import Instrument, upright
from palpate.effects.instrument_penalty import NodeContact, may_touch

UP = np.array([0.0, 0.0, 1.0])


@pytest.mark.parametrize("kind", ["sphere", "capsule", "punch"])
def test_the_force_is_minus_the_gradient_of_the_energy(kind):
    rng = np.random.default_rng(1)
    x = 0.008 * rng.standard_normal((30, 3))
    pose = upright(Instrument(kind, 0.01, edge_m=0.002, length_m=0.01), np.array([0.0, 0.0, -0.005]), UP)
    contact = NodeContact(np.arange(5, 30), rng.uniform(1.0, 3.0, 25), pose)
    force, way = np.zeros_like(x), rng.standard_normal(x.shape)
    contact.add_force(x, np.empty((0, 3)), force)
    ahead, behind = (contact.energy(x + step * way) for step in (1e-8, -1e-8))
    assert np.vdot(force, way) == pytest.approx((behind - ahead) / 2e-8, rel=1e-6)
    assert force.any() and not force[:5].any()


def test_nodes_outside_feel_nothing():
    pose = upright(Instrument("sphere", 0.01), np.zeros(3), UP)
    contact = NodeContact(np.arange(2), np.ones(2), pose)
    pushes = contact.pushes(np.array([[0.0, 0.0, -1e-6], [0.0, 0.0, 2e-3]]))
    assert pushes == pytest.approx(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -2e-3]]))


def test_nodes_that_may_touch_are_free_ones_of_the_surface_nearby():
    mesh = box([0.1, 0.1, 0.1], [4, 4, 4])
    held = np.zeros(len(mesh.nodes), dtype=bool)
    last = upright(Instrument("sphere", 0.03), np.array([0.05, 0.05, 0.095]), UP)
    nodes = may_touch(mesh, held, last, 0.02)
    assert len(nodes) and np.isin(nodes, mesh.surface).all()
    assert (last.gaps(mesh.nodes[nodes])[0] < 0.02).all()
    held[nodes[0]] = True
    assert np.array_equal(may_touch(mesh, held, last, 0.02), nodes[1:])
