"""A system sums what its effects offer, and nothing else."""

import numpy as np
import pytest

from palpate.bodies.particles import Particles, particles_of
from palpate.effects import body_springs, gravity, held, kelvin, push, springs, velocity_damping, volume_preservation
from palpate.effects.settings import BodySprings, Gravity, Kelvin, Load, Push, VelocityDamping, Volume
from palpate.solvers.system import System

LOAD = Load(at_m=[0.2, 0.1, 0.08], force_n=[0.3, 0, -1], radius_m=0.05, press_s=0, hold_s=1, release_s=0)


@pytest.fixture(scope="module")
def particles(slab) -> Particles:
    return particles_of(slab, 0, surface=False)


@pytest.fixture(scope="module")
def effects(particles) -> dict[str, object]:
    """Springs, on couples of two, with what has couples of one, two and four, and with what has none."""
    elastic = springs.make(particles, None)
    made = {
        "springs": elastic,
        "gravity": gravity.make(particles, Gravity(acceleration_m_s2=[0, 0, -9.81]), elastic),
        "volume": volume_preservation.make(particles, Volume(stiffness_n_m=30.0), elastic),
        "body_springs": body_springs.make(particles, BodySprings(stiffness_n_m=40.0, damping_ratio=0.0), elastic),
        "push": push.make(particles, Push(loads=[LOAD]), elastic),
        "kelvin": kelvin.make(particles, Kelvin(ratio=0.2), elastic),
        "velocity_damping": velocity_damping.make(particles, VelocityDamping(rate_1_s=3.0), elastic),
    }
    made["push"].at(0.5)
    return made


@pytest.fixture(scope="module")
def state(particles) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(4)
    return particles.nodes + 0.01 * random.normal(size=particles.nodes.shape), random.normal(size=particles.nodes.shape)


@pytest.fixture
def system(particles, effects) -> System:
    return System(particles, effects)


@pytest.fixture(scope="module")
def alone(particles, effects) -> dict[str, System]:
    return {name: System(particles, {name: effect}) for name, effect in effects.items()}


@pytest.fixture
def anchored(particles, effects) -> System:
    return System(particles, effects | {"held": held.make(particles, None, effects["springs"])})


def same(found: np.ndarray, parts: list[np.ndarray]) -> None:
    assert all(np.any(part) for part in parts)
    np.testing.assert_allclose(found, sum(parts), rtol=0, atol=1e-12 * max(np.abs(part).max() for part in parts))


def test_sums_of_all_are_the_sums_of_each(system, alone, state):
    x, v = state
    assert system.energies(x) == {n: alone[n].energy(x) for n in ("springs", "gravity", "volume", "body_springs")}
    assert system.energy(x) == pytest.approx(sum(one.energy(x) for one in alone.values()), rel=1e-12)
    same(system.force(x, v), [one.force(x, v) for one in alone.values()])
    same(
        system.stiffness(x, True).toarray(),
        [alone[n].stiffness(x, True).toarray() for n in ("springs", "volume", "body_springs")],
    )
    same(system.damping(x).toarray(), [alone[n].damping(x).toarray() for n in ("kelvin", "velocity_damping")])


def test_each_integrator_gets_its_own_share(particles, effects, system, alone, state):
    x, v = state
    pushed, still = alone["push"].force(x, v), [n for n in effects if n not in ("push", "kelvin", "velocity_damping")]
    same(system.explicit_force(x, v), [one.force(x, v) for n, one in alone.items() if n != "velocity_damping"])
    same(system.potential_force(x), [alone[n].force(x, v) for n in still])
    assert np.array_equal(system.outer_force(x, v), pushed)
    norms = [np.linalg.norm(alone[n].force(x, v)) for n in [*still, "push"]]
    assert system.magnitude(x) == pytest.approx(sum(norms), rel=1e-12)
    assert system.magnitude(x, 1e-9 * sum(norms)) == system.magnitude(x)
    effects["volume"].limit = lambda x, direction: 1.0  # as of an effect whose force has no bound
    without = sum(norms) - np.linalg.norm(alone["volume"].force(x, v))
    assert System(particles, effects).magnitude(x, 1e-9) == pytest.approx(without + 1e-9, rel=1e-12)
    del effects["volume"].limit


def test_matrices_are_the_gradients_of_forces_and_share_a_pattern(system, state):
    x, v = state
    k, c = system.stiffness(x, False), system.damping(x)
    assert np.array_equal(k.indices, c.indices) and np.array_equal(k.indptr, c.indptr)
    direction = np.random.default_rng(5).normal(size=x.shape)
    step = 1e-6
    slope = (system.potential_force(x - step * direction) - system.potential_force(x + step * direction)) / (2 * step)
    np.testing.assert_allclose((k @ direction.ravel()).reshape(x.shape), slope, atol=1e-6 * np.abs(slope).max())
    drag = system.force(x, np.zeros_like(v)) - system.force(x, v)
    np.testing.assert_allclose((c @ v.ravel()).reshape(x.shape), drag, atol=1e-12 * np.abs(drag).max())


def test_held_nodes_feel_nothing(particles, anchored, state):
    (x, v), system = state, anchored
    assert np.array_equal(np.flatnonzero(~system.free), np.sort(particles.held))
    for force in (system.force(x, v), system.explicit_force(x, v), system.potential_force(x), system.outer_force(x, v)):
        assert not force[~system.free].any() and force[system.free].any()
    matrix = system.stiffness(x, True)
    expected, unknowns = matrix.toarray(), np.repeat(system.free, 3)
    expected[~unknowns] = np.eye(len(unknowns))[~unknowns]
    expected[:, ~unknowns] = np.eye(len(unknowns))[:, ~unknowns]
    system.hold(matrix)
    np.testing.assert_array_equal(matrix.toarray(), expected)


def test_nothing_is_made_of_what_no_effect_offers(particles, effects, state):
    system = System(particles, {name: effects[name] for name in ("gravity", "push")})
    assert system.stiffness(state[0], True) is None
    assert system.damping(state[0]) is None
    assert len(system.pattern.indices) == len(particles.nodes)  # the masses' diagonal


def test_times_and_inner_variables_are_handed_on(particles, effects):
    class Listener:
        def at(self, t):
            self.time = t

        def relax(self, x, h):
            self.relaxed = x, h

    listener = Listener()
    system = System(particles, {"springs": effects["springs"], "listener": listener})
    system.at(0.25)
    system.relax(particles.nodes, 0.01)
    assert listener.time == 0.25
    assert listener.relaxed[0] is particles.nodes and listener.relaxed[1] == 0.01
    assert system.seconds["listener"] > 0.0
