"""Symplectic Euler: what it keeps, how exact it is, and when it blows up."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from palpate.bodies.material import Material
from palpate.bodies.particles import Particles, particles_of
from palpate.effects import kelvin, springs
from palpate.effects.springs import Springs
from palpate.errors import NotConverged
from palpate.solvers import symplectic_euler
from palpate.solvers.system import System, stable_step

K, M1, M2, REST = 7.0, 0.2, 0.3, 0.1
REDUCED = M1 * M2 / (M1 + M2)


def pair(held=False, ratio=0.0):
    """Two masses on a spring along x, alone in space or with the first held."""
    nodes = np.array([[0.0, 0.0, 0.0], [REST, 0.0, 0.0]])
    none = np.empty((0, 3), dtype=np.int64)
    particles = Particles(
        "pair", nodes, np.array([M1, M2]), np.empty(0, int), none, np.empty((0, 4), int), Material(1.0, 0.0, 1.0)
    )
    effects = {"springs": Springs(np.array([[0, 1]]), np.array([K]), np.array([REST]))}
    if ratio:
        effects["kelvin"] = kelvin.make(particles, {"ratio": ratio}, effects["springs"])
    if held:
        effects["held"] = SimpleNamespace(fixed=np.array([0]))
    return System(particles, effects)


def energy(system, x, v):
    return system.energy(x) + 0.5 * float(np.vdot(system.masses[:, None] * v, v))


def fastest(integrator, x, v, h, steps):
    """The largest speed along the way, which ends once it is far beyond that at the start."""
    largest = 0.0
    for _ in range(steps):
        x, v = integrator.step(x, v, h)
        largest = max(largest, float(np.abs(v).max()))
        if largest > 1e-3:
            break
    return largest


def test_energy_of_a_pair_does_not_drift_over_1e5_steps():
    system = pair()
    integrator = symplectic_euler.make(system, {})
    x, v = system.particles.nodes.copy(), np.array([[-0.05, 0.02, 0.0], [0.07, 0.0, -0.03]])  # it swings and turns
    h = 1e-3 * math.sqrt(REDUCED / K)
    first, worst = energy(system, x, v), 0.0
    for step in range(100_000):
        x, v = integrator.step(x, v, h)
        if step % 20 == 0:
            worst = max(worst, abs(energy(system, x, v) / first - 1.0))
    assert worst < 1e-3
    assert worst > 1e-9  # it does swing


@pytest.mark.parametrize("held", [False, True])
def test_period_of_a_pair(held):
    """2π sqrt(m/k) with the reduced mass, or that of the one that moves; crossings of rest found by interpolation."""
    system = pair(held)
    integrator = symplectic_euler.make(system, {})
    expected = 2 * math.pi * math.sqrt((M2 if held else REDUCED) / K)
    x, v = system.particles.nodes.copy(), np.array([[0.0, 0.0, 0.0], [0.01, 0.0, 0.0]])
    h, crossings, last = expected / 500, [], 0.0
    for step in range(1, 5300):
        x, v = integrator.step(x, v, h)
        stretch = x[1, 0] - x[0, 0] - REST
        if last < 0.0 <= stretch:
            crossings.append((step - stretch / (stretch - last)) * h)
        last = stretch
    periods = np.diff(crossings)
    assert len(periods) >= 8
    assert periods.mean() == pytest.approx(expected, rel=1e-4)


def test_momentum_and_angular_momentum_are_kept(slab, rotation):
    particles = particles_of(slab, 0, False)
    elastic = springs.make(particles, {})
    system = System(particles, {"springs": elastic, "kelvin": kelvin.make(particles, {"ratio": 0.05}, elastic)})
    integrator = symplectic_euler.make(system, {})
    random = np.random.default_rng(4)
    x, v = particles.nodes @ rotation(1.0).T, np.cross([1.0, -2.0, 3.0], particles.nodes) + np.array([0.3, 0.2, 0.1])
    x, v = x + 0.002 * random.normal(size=x.shape), v + 0.1 * random.normal(size=x.shape)
    mass = particles.masses[:, None]
    momentum, spin = (mass * v).sum(axis=0), np.cross(x, mass * v).sum(axis=0)
    for _ in range(2000):
        x, v = integrator.step(x, v, 0.3 * integrator.limit_s)
    assert np.abs((mass * v).sum(axis=0) - momentum).max() < 1e-10 * np.linalg.norm(momentum)
    assert np.abs(np.cross(x, mass * v).sum(axis=0) - spin).max() < 1e-10 * np.linalg.norm(spin)


@pytest.mark.parametrize("ratio", [0.0, 0.2, 1.0, 5.0])
def test_limit_of_a_pair_is_exact(ratio):
    """Just below it the motion stays, just above it grows without end."""
    system = pair(held=True, ratio=ratio)
    integrator = symplectic_euler.make(system, {})
    rate = 2 * ratio * math.sqrt(K * REDUCED) / M2
    assert integrator.limit_s**2 * K / M2 + 2 * integrator.limit_s * rate == pytest.approx(4.0, rel=1e-12)
    for part, grows in ((0.99, False), (1.01, True)):
        v = np.array([[0.0, 0.0, 0.0], [1e-9, 0.0, 0.0]])
        assert (fastest(integrator, system.particles.nodes, v, part * integrator.limit_s, 2000) > 1e-5) == grows


def test_limit_of_a_body_is_where_it_blows_up(slab):
    particles = particles_of(slab, 0, False)
    system = System(particles, {"springs": springs.make(particles, {}), "held": SimpleNamespace(fixed=slab.anchors[0])})
    integrator = symplectic_euler.make(system, {})
    random = np.random.default_rng(5)
    for part, grows in ((0.98, False), (1.02, True)):
        v = 1e-9 * random.normal(size=particles.nodes.shape)
        assert (fastest(integrator, particles.nodes, v, part * integrator.limit_s, 1000) > 1e-5) == grows


def test_limit_by_iteration_is_that_of_all_eigenvalues(slab, monkeypatch):
    particles = particles_of(slab, 0, False)
    elastic = springs.make(particles, {})
    system = System(particles, {"springs": elastic, "kelvin": kelvin.make(particles, {"ratio": 0.2}, elastic)})
    iterated = stable_step(system)
    assert iterated == stable_step(system)
    monkeypatch.setattr("palpate.solvers.system.SMALL", 10_000)
    assert iterated == pytest.approx(stable_step(system), rel=1e-5)


def test_nothing_stiff_has_no_limit(slab):
    particles = particles_of(slab, 0, False)
    assert stable_step(System(particles, {"held": SimpleNamespace(fixed=np.array([0]))})) == math.inf


def test_blowing_up_is_said_not_returned():
    system = pair()
    integrator = symplectic_euler.make(system, {})
    x, v = system.particles.nodes.copy(), np.array([[0.0, 0, 0], [1.0, 0, 0]])
    with pytest.raises(NotConverged, match="diverged"), np.errstate(over="ignore", invalid="ignore"):
        for _ in range(2000):
            x, v = integrator.step(x, v, 10 * integrator.limit_s)
