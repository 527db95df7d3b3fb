"""Gravity: the whole weight, and an energy that it is the gradient of."""

import numpy as np
import pytest

from palpate.bodies.particles import particles_of
from palpate.effects.gravity import make
from palpate.effects.held import make as make_held
from palpate.effects.patch_load import nodal_load
from palpate.effects.push import make as make_push
from palpate.effects.settings import Gravity, Load, Push
from palpate.errors import InputError

ACCELERATION = [1.0, -2.0, -9.81]


@pytest.mark.parametrize("surface", [False, True])
def test_the_whole_weight_and_its_work(slab, surface):
    particles = particles_of(slab, 0, surface)
    gravity = make(particles, Gravity(acceleration_m_s2=ACCELERATION), None)
    force = np.ones_like(particles.nodes)  # it adds
    gravity.add_force(particles.nodes, np.zeros_like(force), force)
    weight = 1000.0 * slab.coarse.volumes.sum() * np.array(ACCELERATION)
    assert (force - 1.0).sum(axis=0) == pytest.approx(weight, rel=1e-12)
    assert gravity.energy(particles.nodes) == 0.0
    # linear in x, so that any displacement shows the gradient
    away = np.random.default_rng(0).normal(size=force.shape)
    assert gravity.energy(particles.nodes + away) == pytest.approx(-np.vdot(force - 1.0, away), rel=1e-12)
    assert gravity.energy(particles.nodes + np.array([0, 0, 2.0])) == pytest.approx(-2.0 * weight[2], rel=1e-12)


@pytest.mark.parametrize("surface", [False, True])
def test_anchors_are_fixed(slab, surface):
    particles = particles_of(slab, 0, surface)
    assert (particles.nodes[make_held(particles, None, None).fixed][:, 0] < 0.03).all()
    assert len(make_held(particles, None, None).fixed) == len(slab.anchors[0])


FORCE = [0.3, -1.2, 0.5]
TIMES = {"start_s": 0.5, "press_s": 0.2, "hold_s": 1.0, "release_s": 0.4}


@pytest.fixture(scope="module", params=[False, True], ids=["volume", "surface"])
def particles(request, slab):
    return particles_of(slab, -1, request.param)


def far_corner(particles):
    return particles.nodes[np.argmax(particles.nodes.sum(axis=1))]


def load(particles, **others):
    given = {"at_m": far_corner(particles), "force_n": FORCE, "radius_m": 0.03} | TIMES | others
    return Load(**given)


def pushed(particles, loads, t):
    push = make_push(particles, Push(loads=loads), None)
    push.at(t)
    force = np.zeros_like(particles.nodes)
    push.add_force(particles.nodes, np.zeros_like(force), force)
    return force


@pytest.mark.parametrize("radius", [0.0, 0.03])
def test_the_force_is_that_of_a_contact_load(particles, slab, radius):
    force = pushed(particles, [load(particles, radius_m=radius)], 1.0)
    contact = int(np.argmin(np.linalg.norm(slab.fine.nodes - far_corner(particles), axis=1)))
    expected = nodal_load(slab, -1, contact, np.array(FORCE), radius)
    kept = slab.fine.surface if len(force) < len(expected) else slice(None)
    assert force == pytest.approx(expected[kept], rel=1e-12, abs=1e-18)
    assert force.sum(axis=0) == pytest.approx(FORCE, rel=1e-12)
    assert (np.count_nonzero(force.any(axis=1)) > 1) == (radius > 0.0)


@pytest.mark.parametrize(
    ("t", "share"),
    [(0.0, 0), (0.5, 0), (0.55, 5 / 32), (0.6, 0.5), (0.7, 1), (1.2, 1), (1.7, 1), (1.9, 0.5), (2.1, 0), (9.0, 0)],
)
def test_it_is_pressed_held_and_released(particles, t, share):
    assert pushed(particles, [load(particles)], t).sum(axis=0) == pytest.approx(share * np.array(FORCE), abs=1e-12)


def test_a_load_without_ramps_is_there_at_once(particles):
    sudden = load(particles, press_s=0.0, release_s=0.0)
    for t, share in ((0.4999, 0.0), (0.5, 1.0), (1.4999, 1.0), (1.5001, 0.0)):
        assert pushed(particles, [sudden], t).sum(axis=0) == pytest.approx(share * np.array(FORCE), abs=1e-12)


def test_loads_add_up_and_nothing_presses_before_its_time_is_told(particles):
    both = [load(particles), load(particles, force_n=[0, 0, 1.0], start_s=0.0)]
    together, one, other = (pushed(particles, loads, 1.0) for loads in (both, both[:1], both[1:]))
    assert np.abs(together - one - other).max() < 1e-15
    force = np.zeros_like(particles.nodes)
    push = make_push(particles, Push(loads=[load(particles, start_s=0.0, press_s=0.0)]), None)
    push.add_force(particles.nodes, force, force)
    assert push.outer and not force.any()


def test_a_load_far_away_or_on_the_anchors_is_refused(particles):
    with pytest.raises(InputError, match=r"push\.loads\[1\]\.at_m is .* m from the nearest point of its"):
        make_push(particles, Push(loads=[load(particles), load(particles, at_m=[200.0, 100.0, 80.0])]), None)
    near = particles.nodes[particles.surface].max(axis=0) + 0.2 * particles.size
    with pytest.raises(InputError, match=r"give a point on the surface, in metres\.$"):
        make_push(particles, Push(loads=[load(particles, at_m=near)]), None)
    with pytest.raises(InputError, match=r"push\.loads\[0\]\.radius_m is 12 m, and the whole body is"):
        make_push(particles, Push(loads=[load(particles, radius_m=12.0)]), None)
    with pytest.raises(InputError, match="which is held"):
        make_push(particles, Push(loads=[load(particles, at_m=particles.nodes[particles.held[0]])]), None)
