"""A cut that is made while a body moves: as the whole body before, as the severed one after, without any energy."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.bodies.body import Body, nest
from palpate.bodies.material import Material
from palpate.bodies.mesh import components
from palpate.bodies.particles import Particles, particles_of
from palpate.bodies.simple_shapes import box
from palpate.scenes.run_scene import compose, run
from palpate.scenes.scene import Scene, particles_in

G = 9.81
MATERIAL = Material(2e4, 0.3, 1000.0)
NOTCH = {"path_m": [[0.095, -0.01, 0.04], [0.095, 0.05, 0.04]], "depth_m": 0.02}
SLOWLY = NOTCH | {"at_s": 0.05, "lasts_s": 0.05, "way": "split_faces"}
THROUGH = {"plane": {"point_m": [0.095, 0.0, 0.0], "normal": [1.0, 0.0, 0.0]}, "at_s": 0.04, "lasts_s": 0.0}
THROUGH |= {"way": "split_faces"}
INTEGRATORS = {"backward_euler": 1, "bdf2": 1, "symplectic_euler": "auto"}


@pytest.fixture(scope="module")
def bar() -> Body:
    mesh = box([0.2, 0.04, 0.04], [10, 3, 3])
    return nest("bar", mesh, 0, np.flatnonzero(mesh.nodes[:, 0] < 1e-9), MATERIAL)


def sagging(integrator="backward_euler", cut=None, elastic="corotational", **more) -> Scene:
    """A bar that falls under its weight, held at one end, and is cut."""
    settings = {"gravity": {"acceleration_m_s2": [0.0, 0.0, -G]}}
    settings |= (
        {"kelvin": {"ratio": 0.1}} if elastic == "springs" else {"rayleigh": {"mass_1_s": 0.5, "stiffness_s": 0.005}}
    )
    settings |= {"cut": cut} if cut else {}
    settings |= more.pop("settings", {})
    return Scene(
        "sagging",
        [elastic, "held", *settings],
        integrator,
        0.01,
        more.pop("duration_s", 0.16),
        substeps=INTEGRATORS[integrator],
        frames=1000,
        settings=settings,
        **more,
    )


def severed(particles: Particles) -> Particles:
    """Particles that were never tied."""
    return replace(particles, ties=None)


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("way", ["split_faces", "virtual_nodes"])
def test_before_the_blade_a_body_moves_as_one_that_is_whole(bar, integrator, way):
    scene = sagging(integrator, SLOWLY | {"way": way})
    particles = particles_in(scene, [bar])
    # each node as the one that it is doubled from, found by its place
    from_whole = np.linalg.norm(particles.nodes[:, None] - bar.coarse.nodes[None], axis=2).argmin(axis=1)
    found = run(scene, particles).motion
    whole = run(sagging(integrator), particles_of(bar, 0, False)).motion
    apart = np.abs(found.positions - whole.positions[:, from_whole]).max(axis=(1, 2))
    steps = np.arange(len(found.times))
    before = steps <= 5  # the blade starts at step 5, so that the next one ends elsewhere
    assert apart[before].max() < 1e-13
    assert apart[-1] > 1e-3
    opened = found.observed["cut_opening_m"].to_numpy()
    assert (opened[:5] == 0.0).all() and opened[-1] > 5e-3


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("elastic", ["corotational", "springs"])
def test_a_cut_at_once_at_the_start_is_a_body_that_was_severed_before(bar, integrator, elastic):
    scene = sagging(integrator, SLOWLY | {"at_s": 0.0, "lasts_s": 0.0}, elastic)
    particles = particles_in(scene, [bar])
    found = run(scene, particles).motion
    other = run(sagging(integrator, elastic=elastic), severed(particles)).motion
    assert np.abs(found.positions - other.positions).max() < 1e-13
    assert np.abs(found.positions[-1] - found.positions[-1][particles.ties.leaders()]).max() > 4e-3


def test_what_is_cut_slowly_settles_where_what_was_severed_does(bar):
    damped = {"rayleigh": {"mass_1_s": 9.0, "stiffness_s": 0.005}}
    scene = replace(sagging(cut=SLOWLY, settings=damped, duration_s=6.0), step_s=0.02)
    particles = particles_in(scene, [bar])
    found = run(scene, particles).motion.positions
    other = run(sagging(settings=damped, duration_s=6.0), severed(particles)).motion.positions
    still = np.abs(found[-1] - found[-2]).max()
    assert still < 1e-7
    assert np.abs(found[-1] - other[-1]).max() < 1e-6 < 1e-3 < np.abs(found[-1] - particles.nodes).max()


def test_letting_go_changes_no_energy_and_no_momentum_at_all(bar):
    scene = sagging(cut=SLOWLY)
    particles = particles_in(scene, [bar])
    system, random = compose(scene, particles), np.random.default_rng(3)
    tied, free = particles.ties.leaders(), particles.ties.leaders(np.inf)
    system.tie(tied)
    x, v = (system.followed(random.normal(size=particles.nodes.shape)) for _ in range(2))
    found = []
    for leaders in (tied, particles.ties.leaders(0.08), free):
        system.tie(leaders)
        momentum = (system.masses[:, None] * v).sum(axis=0)
        found.append((system.energies(x), 0.5 * float(np.vdot(system.masses[:, None] * v, v)), momentum))
    for energies, kinetic, momentum in found[1:]:
        assert energies == found[0][0]
        assert kinetic == pytest.approx(found[0][1], rel=1e-14)
        assert momentum == pytest.approx(found[0][2], rel=1e-13)
    assert len({len(np.unique(leaders)) for leaders in (tied, particles.ties.leaders(0.08), free)}) == 3


@pytest.mark.parametrize("way", ["split_faces", "virtual_nodes"])
def test_the_books_of_a_cut_close(bar, way):
    """Newton's second law for all nodes by themselves, with the forces of a body that was severed before.

    What kinetic and potential energy lose is what dampers and the scheme take in each step, by its own identity, if
    ties do no work, neither while they hold nor when they end.
    """
    scene = replace(sagging(cut=SLOWLY | {"way": way}, duration_s=0.3), tolerance=1e-10)
    particles = particles_in(scene, [bar])
    motion = run(scene, particles).motion
    alone, x, h = compose(sagging(), severed(particles)), motion.positions, scene.step_s
    masses = particles.masses[:, None]
    v = np.diff(np.concatenate([x[:1], x]), axis=0) / h
    damped = scheme = 0.0
    for before, after, slow, fast in zip(x, x[1:], v, v[1:], strict=False):
        damping = np.zeros_like(fast)
        alone.effects["rayleigh"].add_force(before, fast, damping)
        damped -= h * float(np.vdot(damping, fast))
        scheme += 0.5 * float(np.vdot(masses * (fast - slow), fast - slow))
        work = np.zeros_like(fast)
        for name in ("corotational", "gravity"):
            alone.effects[name].add_force(after, fast, work)
        scheme += alone.energy(before) - alone.energy(after) - float(np.vdot(work, after - before))
    stored = 0.5 * float(np.vdot(masses * v[-1], v[-1])) + alone.energy(x[-1]) - alone.energy(x[0])
    done = alone.energies(x[0])["gravity"] - alone.energies(x[-1])["gravity"]
    assert done > 1e-3 and damped > 0.01 * done and scheme > 0.01 * done
    assert abs(stored + damped + scheme) < 1e-8 * done
    assert motion.energy["gain_j"].iloc[-1] <= 1e-8 * done


def freed(bar, **more):
    """A bar whose outer half is cut off, without damping, in short steps: particles, motion, which nodes fall."""
    settings = {"gravity": {"acceleration_m_s2": [0.0, 0.0, -G]}, "cut": THROUGH} | more
    scene = Scene("cut_off", ["corotational", "held", *settings], "symplectic_euler", 5e-4, 0.1, frames=200)
    scene = replace(scene, settings=settings)
    particles = particles_in(scene, [bar])
    piece = components(particles.tetrahedra[:, [0, 1, 0, 2, 0, 3]].reshape(-1, 2), len(particles.nodes))
    return particles, run(scene, particles).motion, np.flatnonzero(~np.isin(piece, piece[particles.held]))


def test_the_half_that_is_cut_off_falls_freely_and_turns_on(bar):
    particles, motion, half = freed(bar)
    x, m, h = motion.positions[:, half], particles.masses[half, None], 5e-4
    assert 0.4 < len(half) / len(particles.nodes) < 0.6
    place = (m * x).sum(axis=1) / m.sum()
    acceleration = np.diff(place, n=2, axis=0) / h**2
    cut = int(THROUGH["at_s"] / h)
    assert np.abs(acceleration[cut:] - [0.0, 0.0, -G]).max() < 1e-6 * G
    assert np.abs(acceleration[: cut - 1] - [0.0, 0.0, -G]).max() > 0.05 * G
    # g t²/2 from the state that it was let go in, the sum of the scheme's even steps
    t = h * np.arange(len(place) - cut)
    fall = place[cut] + np.outer(t, (place[cut] - place[cut - 1]) / h) - np.outer(0.5 * t * (t + h), [0.0, 0.0, G])
    assert np.abs(place[cut:] - fall).max() < 1e-12
    v = np.diff(x, axis=0) / h
    away = x[1:] - place[1:, None]
    spin = np.cross(away, m * v).sum(axis=1)
    assert np.abs(spin[cut:] - spin[cut]).max() < 1e-10 * np.abs(spin[cut]).max()
    assert np.ptp(spin[:cut], axis=0).max() > 0.1 * np.abs(spin[cut]).max()
