"""A cut that is made while a body moves: as the whole body before, as the severed one after, without any energy."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from palpate.bodies.body import Body, nest
from palpate.bodies.material import Material
from palpate.bodies.mesh import components
from palpate.bodies.particles import Particles, particles_of
from palpate.bodies.settings import Box
from palpate.bodies.simple_shapes import box
from palpate.collision.triangles.closest_points import POINT_TRIANGLE, closest_points
from palpate.errors import InputError
from palpate.scenes.moved_particles import particles_in
from palpate.scenes.run_scene import compose, run
from palpate.scenes.scene_check import check_effects
from palpate.scenes.settings import Scene

G = 9.81
MATERIAL = Material(2e4, 0.3, 1000.0)
NOTCH = {"path_m": [[0.095, -0.01, 0.04], [0.095, 0.05, 0.04]], "depth_m": 0.02}
SLOWLY = NOTCH | {"at_s": 0.05, "lasts_s": 0.05, "way": "split_faces"}
RAYLEIGH = {"mass_1_s": 0.5, "stiffness_s": 0.005}
SEWN = {"threads": [{"ends_m": [[0.09, 0.02, 0.04], [0.105, 0.02, 0.04]], "stiffness_n_m": 500.0, "start_s": 0.0}]}
SEWN["threads"][0] |= {"tighten_s": 0.05, "tightened_to": 0.8}
"""A thread over the cut, which deforms the body before the blade comes."""
THROUGH = {"plane": {"point_m": [0.095, 0.0, 0.0], "normal": [1.0, 0.0, 0.0]}, "at_s": 0.04, "lasts_s": 0.0}
THROUGH |= {"way": "split_faces"}
NEWTON = {"backward_euler": 1, "bdf2": 1, "symplectic_euler": "auto"}
"""Integrators that step all elements together, and their substeps."""
FEW = {
    "xpbd": {"iterations": 5},
    "projective_dynamics": {"iterations": 5, "memory": 0},
    "vertex_block_descent": {"sweeps": 5, "radius": 0.0},
}
"""Those that relax them one by one, with few iterations."""


@pytest.fixture(scope="module")
def bar() -> Body:
    mesh = box([0.2, 0.04, 0.04], [10, 3, 3])
    return nest("bar", mesh, 0, np.flatnonzero(mesh.nodes[:, 0] < 1e-9), MATERIAL)


def sagging(integrator="backward_euler", cut=None, elastic="corotational", duration_s=0.16, **blocks) -> Scene:
    """A bar that falls under its weight, held at one end, and is cut."""
    damped = {"springs": {}, "kelvin": {"ratio": 0.1}} if elastic == "springs" else {"rayleigh": RAYLEIGH}
    given = {"gravity": {"acceleration_m_s2": [0.0, 0.0, -G]}} | damped | blocks
    given |= {integrator: FEW[integrator]} if integrator in FEW else {}
    stepped = {"integrator": integrator, "step_s": 0.01, "substeps": NEWTON.get(integrator, 1), "frames": 1000}
    return Scene(name="sagging", body="bar", cut=cut, duration_s=duration_s, **stepped, **given)


def severed(particles: Particles) -> Particles:
    """Particles that were never tied."""
    return replace(particles, ties=None)


@pytest.mark.parametrize(
    ("integrator", "way", "more"),
    [
        *((name, "split_faces", {}) for name in (*NEWTON, *FEW)),
        ("backward_euler", "virtual_nodes", {}),
        *((name, "split_faces", SEWN) for name in ("backward_euler", "projective_dynamics")),
    ],
)
def test_before_the_blade_a_body_moves_as_one_that_is_whole(bar, integrator, way, more):
    scene = sagging(integrator, SLOWLY | {"way": way}, **more)
    particles = particles_in(scene, [bar])
    # each node as the one that it is doubled from, found by its place
    from_whole = np.linalg.norm(particles.nodes[:, None] - bar.coarse.nodes[None], axis=2).argmin(axis=1)
    found = run(scene, particles).motion
    whole = run(sagging(integrator, **more), particles_of(bar, 0, False)).motion
    apart = np.abs(found.positions - whole.positions[:, from_whole]).max(axis=(1, 2))
    steps = np.arange(len(found.times))
    before = steps <= 5  # the blade starts at step 5, so that the next one ends elsewhere
    assert apart[before].max() < 1e-13
    assert apart[-1] > 1e-3
    opened = found.observed["cut_opening_m"].to_numpy()
    assert (opened[:5] == 0.0).all() and opened[-1] > 2e-3


@pytest.mark.parametrize(
    ("integrator", "elastic", "way"),
    [
        *((name, elastic, "split_faces") for name in NEWTON for elastic in ("corotational", "springs")),
        *((name, "corotational", way) for name in FEW for way in ("conform", "virtual_nodes")),
    ],
)
def test_a_cut_at_once_at_the_start_is_a_body_that_was_severed_before(bar, integrator, elastic, way):
    scene = sagging(integrator, SLOWLY | {"at_s": 0.0, "lasts_s": 0.0, "way": way}, elastic)
    particles = particles_in(scene, [bar])
    found = run(scene, particles).motion
    other = run(sagging(integrator, elastic=elastic), severed(particles)).motion
    assert np.abs(found.positions - other.positions).max() < 1e-13
    assert np.abs(found.positions[-1] - found.positions[-1][particles.ties.leaders()]).max() > 1e-3


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
    scene = sagging(cut=SLOWLY | {"way": way}, duration_s=0.3).but(tolerance=1e-10)
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


def freed(bar):
    """A bar whose outer half is cut off, without damping, in short steps: particles, motion, which nodes fall."""
    scene = sagging("symplectic_euler", THROUGH, duration_s=0.1, rayleigh=None)
    scene = scene.but(step_s=5e-4, substeps=1, frames=200)
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


def test_projective_dynamics_that_converges_moves_as_backward_euler_while_a_blade_passes(bar):
    found = []
    for integrator in ("backward_euler", "projective_dynamics"):
        own = {"projective_dynamics": {"iterations": 60, "memory": 5}} if integrator != "backward_euler" else {}
        scene = sagging(integrator, SLOWLY | {"way": "conform"}).but(**own)
        found.append(run(scene, particles_in(scene, [bar])).motion.positions)
    assert np.abs(found[0] - found[1]).max() < 1e-9 < 1e-3 < np.abs(found[0][-1] - found[0][5]).max()


def distance(place: np.ndarray, x: np.ndarray, triangles: np.ndarray) -> float:
    """The distance [m] of a place from the nearest of some triangles."""
    kinds = np.full(len(triangles), POINT_TRIANGLE)
    stencils = np.column_stack([np.full(len(triangles), len(x)), triangles])
    return float(closest_points(kinds, stencils, np.vstack([x, place]))[0].min())


BALL = {"kind": "sphere", "name": "ball", "center_m": [0.095, 0.02, 0.0445], "radius_m": 0.004}
BALL |= {"times_s": [0.0, 0.05, 0.2], "shifts_m": [[0, 0, 0], [0, 0, -0.002], [0, 0, -0.02]]}


def pressed(integrator: str, way: str) -> tuple[Scene, Scene, Body]:
    """A ball that is pressed on a bar, from 0.1 s on where it is cut; the same without the cut; the bar."""
    mesh = box([0.2, 0.04, 0.04], [10, 3, 3])
    ends = np.flatnonzero((mesh.nodes[:, 0] < 1e-9) | (mesh.nodes[:, 0] > 0.2 - 1e-9))
    damped, contact = {"mass_1_s": 5.0, "stiffness_s": 0.005}, {"instruments": [BALL], "friction": 0.2}
    stepped = {"integrator": integrator, "step_s": 0.01, "duration_s": 0.2, "substeps": NEWTON[integrator]}
    whole = Scene(name="pressed", body="bar", **stepped, frames=100, contact=contact, rayleigh=damped)
    cut = NOTCH | {"depth_m": 0.03, "at_s": 0.1, "lasts_s": 0.0, "way": way}
    return whole.but(cut=cut), whole, nest("bar", mesh, 0, ends, MATERIAL)


@pytest.mark.parametrize(
    "integrator",
    [pytest.param(name, marks=pytest.mark.slow) if name == "symplectic_euler" else name for name in NEWTON],
)
def test_before_the_blade_an_instrument_feels_a_body_that_is_whole(integrator):
    scene, whole, body = pressed(integrator, "split_faces")
    found, other = run(scene, particles_in(scene, [body])).motion, run(whole, particles_of(body, 0, False)).motion
    # an explicit step ends where contact's own Newton has converged
    assert np.abs(found.positions[:11, : len(body.coarse.nodes)] - other.positions[:11]).max() < 1e-6
    force, uncut = (each.observed["ball_force_z_n"].to_numpy() for each in (found, other))
    assert np.abs(force[9] - uncut[9]).max() < 1e-3 * uncut[9]
    assert force[-1] < 0.95 * uncut[-1]


def test_an_instrument_touches_the_face_that_a_cut_has_made(bar):
    """The outer half falls away, and a ball that comes from there meets the face where it was."""
    ball = {"kind": "sphere", "name": "ball", "center_m": [0.25, 0.02, 0.02], "radius_m": 0.008}
    ball |= {"times_s": [0.0, 0.2, 0.3], "shifts_m": [[0, 0, 0], [0, 0, 0], [-0.155, 0, 0]]}
    settings = {"contact": {"instruments": [ball]}, "rayleigh": {"mass_1_s": 20.0, "stiffness_s": 0.001}}
    stiff = replace(bar, material=Material(2e5, 0.3, 1000.0))
    scene = sagging(cut=THROUGH | {"way": "conform"}, **settings, duration_s=0.3)
    particles = particles_in(scene, [stiff])
    motion = run(scene, particles).motion
    skin = {tuple(sorted(triangle)) for triangle in particles.triangles.tolist()}
    lips = np.array([triangle for triangle in motion.triangles.tolist() if tuple(sorted(triangle)) not in skin])
    assert len(motion.triangles) == len(skin) + len(lips)
    assert np.abs(particles.nodes[lips][..., 0] - 0.095).max() < 1e-9
    place, x = np.array(ball["center_m"]) + ball["shifts_m"][-1], motion.positions[-1]
    least = distance(place, x, motion.triangles)
    assert ball["radius_m"] < least < ball["radius_m"] + 2e-4  # the gap is 0.2 mm
    assert distance(place, x, lips) == least
    last = motion.contacts.query("time_s > 0.29")
    assert (np.abs(last["normal_x"]) > 0.8).all() and (last["x_m"] < 0.095).all()
    assert motion.observed["ball_force_x_n"].iloc[-1] > 0.1


def test_it_is_said_that_nothing_holds_what_is_cut_off(bar):
    scene = sagging(cut=THROUGH, duration_s=0.06, gravity=None)
    with pytest.warns(UserWarning, match="frees 5[0-9.]*% of the mass, which nothing holds"):
        run(scene, particles_in(scene, [bar]))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run(sagging(cut=THROUGH, duration_s=0.06), particles_in(scene, [bar]))


def test_a_cut_through_what_is_held_leaves_it_held(bar):
    cut = {"plane": {"point_m": [0.0, 0.021, 0.0], "normal": [0.0, 1.0, 0.0]}, "at_s": 0.02, "lasts_s": 0.0}
    for way in ("conform", "split_faces", "virtual_nodes"):
        scene = sagging(cut=cut | {"way": way}, duration_s=0.1)
        particles = particles_in(scene, [bar])
        motion = run(scene, particles).motion
        assert np.array_equal(
            motion.positions[:, particles.held], motion.positions[:1, particles.held].repeat(11, axis=0)
        )
        assert np.ptp(particles.nodes[particles.held], axis=0)[1] == pytest.approx(0.04)
        assert motion.observed["cut_opening_m"].iloc[-1] > 0.0


@pytest.mark.parametrize("more", [{"shift_m": [0.0, 0.0, 0.004]}, {"force_n": [0.0, 0.0, 0.3]}])
def test_a_hook_beside_lips_that_are_closed_is_that_of_a_whole_body(bar, more):
    """Its patch has nodes that lead and nodes that follow those of the other lip."""
    hook = {"at_m": [0.09, 0.02, 0.04], "radius_m": 0.03, "start_s": 0.0, "pull_s": 0.02, "hold_s": 1.0} | more
    hooks = [hook | {"release_s": 0.0}]
    later = SLOWLY | {"at_s": 0.1, "lasts_s": 0.01}
    scene = sagging("symplectic_euler", later, hooks=hooks, duration_s=0.1)
    particles = particles_in(scene, [bar])
    other = sagging("backward_euler", later, hooks=hooks, duration_s=0.1)
    found, implicit = (run(each.but(step_s=0.001), particles).motion for each in (scene, other))
    apart = np.abs(found.positions[-1] - implicit.positions[-1]).max()
    assert apart < 0.03 * np.abs(implicit.positions[-1] - particles.nodes).max()
    forces = [motion.observed["hook_0_force_z_n"].iloc[-40:].mean() for motion in (found, implicit)]
    assert forces[0] == pytest.approx(forces[1], rel=0.05)


STIFFNESS = {"young_pa": 2e4, "poisson": 0.3, "density_kg_m3": 1000, "anchors": {"nodes": [0, 1, 2]}}
PULLED = {"at_m": [0.2, 0, 0], "shift_m": [0, 0, 0.01]}


@pytest.mark.parametrize(
    ("more", "told"),
    [
        ({"cut": {"at_s": 1.0}}, "cut begins at 1 s, and the scene ends"),
        ({"cut": {"way": "virtual_nodes"}, "contact": {"instruments": [BALL]}}, "contact touches faces"),
        ({"contact": {"instruments": [BALL], "self_contact": True}}, "self_contact is true"),
        ({"integrator": "xpbd", "contact": {"instruments": [BALL]}}, "no part for cut and contact together"),
        ({"integrator": "projective_dynamics", "hooks": [PULLED]}, "no part for cut and hooks together"),
        ({"others": [{"body": "bar", "shift_m": [0, 0, 1]}], "cut": {"way": "virtual_nodes"}}, "touch"),
        ({"integrator": "goal_position", "shape_matching": {"mode": "linear"}}, "cut, which works with corotational"),
    ],
)
def test_what_a_cut_does_not_go_with_is_refused_when_planned(more, told):
    body = Box(kind="box", sizes_m=[0.2, 0.04, 0.04], divisions=[10, 3, 3], refinements=0, **STIFFNESS)
    cut = SLOWLY | more.get("cut", {})
    scene = Scene(body="bar", step_s=0.01, duration_s=0.5, **(more | {"cut": cut}))
    with pytest.raises(InputError, match=told):
        check_effects("scenes.bar", scene, {"bar": body})
