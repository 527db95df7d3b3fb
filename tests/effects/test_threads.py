"""Threads: exact derivatives, ends that all levels share, and pulls that closed solutions give."""

import numpy as np
import pytest
from fixtures.severed import severed

from palpate.bodies.body import nest
from palpate.bodies.material import Material
from palpate.bodies.organs import liver
from palpate.bodies.particles import merge_particles, particles_of
from palpate.bodies.simple_shapes import box
from palpate.effects.patch_load import nearest_on_surface
from palpate.effects.settings import Gravity, ProjectiveDynamics, Rayleigh, Thread, Xpbd
from palpate.effects.threads import make
from palpate.errors import InputError
from palpate.linalg.block_pattern import gather
from palpate.scenes.run_scene import compose, run
from palpate.scenes.settings import Scene
from palpate.solvers.system import stable_step

MATERIAL = Material(5000.0, 0.3, 1000.0)
ACROSS = [[0.03, 0.012, 0.03], [0.07, 0.018, 0.03]]


def thread(**changed) -> Thread:
    return Thread(**({"ends_m": ACROSS, "tighten_s": 0.1, "tightened_to": 0.8} | changed))


def bar(cells=(6, 2, 2), refinements=0, held=True):
    mesh = box([0.1, 0.03, 0.03], list(cells))
    return nest("bar", mesh, refinements, np.flatnonzero(mesh.nodes[:, 0] < 1e-9) if held else np.array([0]), MATERIAL)


@pytest.fixture(scope="module")
def particles():
    return particles_of(bar(), 0, surface=False)


def moved(particles, seed=0):
    return particles.nodes + 1e-3 * np.random.default_rng(seed).normal(size=particles.nodes.shape)


def pulling(particles, *entries, t=1.0):
    threads = make(particles, list(entries), None)
    threads.at(t)
    return threads


def hessian(threads, x, definite=False):
    return gather([threads.touching(x, definite)], len(x)).toarray()


def scene(threads, integrator="backward_euler", stiffness_s=0.01, duration_s=1.0, **more) -> Scene:
    damping = Rayleigh(mass_1_s=20.0, stiffness_s=stiffness_s)
    times = {"integrator": integrator, "step_s": 0.01, "duration_s": duration_s}
    return Scene(body="sewn", **times, **({"threads": threads, "rayleigh": damping} | more))


def test_force_and_stiffness_are_derivatives_and_no_direction_is_soft(particles, force_of, differences, check_frame):
    threads, x = pulling(particles, thread(), thread(ends_m=[[0.1, 0, 0], [0.09, 0.03, 0.03]])), moved(particles)
    assert (threads.tensions(x) > 1.0).all()
    slope = -differences(threads.energy, x, 1e-7).reshape(x.shape)
    assert np.abs(force_of(threads, x) - slope).max() < 1e-7 * np.abs(slope).max()
    slope, matrix = -differences(lambda y: force_of(threads, y), x, 1e-7), hessian(threads, x)
    assert np.abs(matrix - slope).max() < 1e-6 * np.abs(matrix).max()
    assert np.linalg.eigvalsh(matrix)[0] > -1e-12 * np.abs(matrix).max()
    assert np.array_equal(matrix, hessian(threads, x, definite=True))
    check_frame(threads, x, 0.1)


def test_energy_and_force_are_continuous_where_a_thread_becomes_taut(particles, force_of):
    threads = pulling(particles, thread(tightened_to=1.0))
    across = np.subtract(*ACROSS[::-1])
    length = np.linalg.norm(across)
    for stretch in (-1e-3, -1e-9, 0.0, 1e-9, 1e-3):
        x = particles.nodes + np.outer(particles.nodes @ across, across) * stretch / length**3  # along the thread alone
        tension = 5000.0 * max(stretch, 0.0)
        assert threads.tensions(x)[0] == pytest.approx(tension, rel=1e-6, abs=1e-12)
        assert threads.energy(x) == pytest.approx(0.5 * tension * max(stretch, 0.0), rel=1e-6, abs=1e-18)
        assert force_of(threads, x).any() == (stretch > 0.0)
        assert bool(len(threads.touching(x, True)[0])) == (stretch >= 0.0)


def test_a_thread_of_no_length_draws_its_ends_together(particles, force_of):
    threads, x = pulling(particles, thread(length_m=0.0, stiffness_n_m=10.0)), particles.nodes.copy()
    assert threads.tensions(x)[0] == pytest.approx(10.0 * np.linalg.norm(np.subtract(*ACROSS)), rel=1e-12)
    x[:] = x.mean(axis=0)
    assert np.abs(force_of(threads, x)).max() < 1e-15 and np.linalg.eigvalsh(hessian(threads, x))[-1] > 1.0


@pytest.mark.parametrize(("integrator", "stiffness_s"), [("backward_euler", 0.01), ("symplectic_euler", 1e-4)])
def test_a_slack_thread_changes_no_bit(particles, integrator, stiffness_s):
    loose = thread(ends_m=[[0.03, 0.0, 0.0], [0.07, 0.0, 0.0]], tighten_s=0.0, tightened_to=1.5)
    drop, parts = Gravity(acceleration_m_s2=[0, 0, -9.81]), 1 if integrator == "backward_euler" else 20
    sewn = scene([loose], integrator, stiffness_s, 0.2, gravity=drop, substeps=parts)
    motion, without = run(sewn, particles).motion, run(sewn, particles, without="threads").motion
    assert np.array_equal(motion.positions, without.positions)
    assert not motion.observed.filter(like="thread_").any(axis=None)


def test_a_slack_thread_pushes_nothing_in_xpbd(particles):
    threads, x = pulling(particles, thread(tighten_s=0.0, tightened_to=1.5)), particles.nodes.copy()
    threads.correct(x, 1.0 / particles.masses, 0.01, True)
    assert np.array_equal(x, particles.nodes)


def compliance(particles, ends):
    """What the ends of a thread yield to a unit tension [m/N], by a linear solve of the elements' stiffness."""
    system = compose(scene(None), particles)
    nodes, weights, _ = nearest_on_surface(particles, np.array(ends))
    way = np.subtract(*ends[::-1]) / np.linalg.norm(np.subtract(*ends))
    load = np.zeros_like(particles.nodes)
    for corners, shares, sign in zip(nodes, weights, (1.0, -1.0), strict=True):
        np.add.at(load, corners, sign * np.outer(shares, way))
    free = np.repeat(system.free, 3)
    stiffness = system.stiffness(particles.nodes, False).toarray()[np.ix_(free, free)]
    return float(load.ravel()[free] @ np.linalg.solve(stiffness, load.ravel()[free]))


METHODS = [
    ("backward_euler", {}, 0.01, 1e-3),
    ("bdf2", {}, 0.01, 1e-3),
    ("symplectic_euler", {"substeps": "auto"}, 1e-4, 1e-3),
    ("xpbd", {"xpbd": Xpbd(iterations=10), "substeps": 10}, 0.0, 5e-3),
    ("projective_dynamics", {"projective_dynamics": ProjectiveDynamics(iterations=20, memory=5)}, 0.01, 1e-3),
]


@pytest.mark.parametrize(("integrator", "own", "stiffness_s", "error"), METHODS)
def test_two_bars_are_stretched_as_springs_in_a_row(integrator, own, stiffness_s, error):
    """T = shortening / (1/k + c), c the compliance of the held bars at the ends; for small strain."""
    mesh = box([0.04, 0.02, 0.02], [3, 2, 2])
    left = particles_of(nest("left", mesh, 0, np.flatnonzero(mesh.nodes[:, 0] < 1e-9), MATERIAL), 0, surface=False)
    right = particles_of(nest("right", mesh, 0, np.flatnonzero(mesh.nodes[:, 0] > 0.0399), MATERIAL), 0, surface=False)
    pair = merge_particles([left, right], [[0, 0, 0], [0.05, 0, 0]], "pair")
    ends, short, stiffness = [[0.04, 0.01, 0.01], [0.05, 0.01, 0.01]], 2e-4, 30.0
    sewn = thread(ends_m=ends, stiffness_n_m=stiffness, length_m=0.01 - short)
    found = run(scene([sewn], integrator, stiffness_s, **own), pair).motion
    felt = found.observed["thread_0_force_x_n"].iloc[-1]
    assert felt == pytest.approx(short / (1.0 / stiffness + compliance(pair, ends)), rel=error)


def test_a_thread_between_free_bodies_keeps_their_momentum():
    block = particles_of(nest("block", box([0.02, 0.02, 0.02], [2, 2, 2]), 0, np.array([0]), MATERIAL), 0, False)
    pair = merge_particles([block, block], [[0, 0, 0], [0.04, 0.006, 0]], "pair")
    sewn = thread(ends_m=[[0.02, 0.004, 0.01], [0.04, 0.02, 0.013]], tightened_to=0.5)
    motion = run(scene([sewn], duration_s=0.3, held=False, rayleigh=None), pair).motion
    middle = pair.masses @ motion.positions.reshape(len(motion.times), -1, 3).transpose(1, 0, 2).reshape(
        len(pair.masses), -1
    )
    apart = np.linalg.norm(
        motion.positions[:, : len(block.nodes)].mean(axis=1) - motion.positions[:, len(block.nodes) :].mean(axis=1),
        axis=1,
    )
    assert apart[-1] < 0.8 * apart[0]
    assert np.abs(middle.reshape(-1, 3) - middle.reshape(-1, 3)[0]).max() < 1e-9 * pair.masses.sum() * 0.06


def test_an_explicit_step_is_short_enough_for_a_taut_thread(particles):
    """√(k w M⁻¹ w) is the thread's own frequency, below which no step of the whole can be stable."""
    stiff = thread(stiffness_n_m=1e5)
    system = compose(scene([stiff], "symplectic_euler", stiffness_s=0.0), particles)
    nodes, weights, _ = nearest_on_surface(particles, np.array(ACROSS))
    alone = np.sqrt(1e5 * np.sum(weights**2 / particles.masses[nodes]))
    assert stable_step(system) == pytest.approx(2.0 / alone, rel=0.05)
    found = run(scene([stiff], "symplectic_euler", 0.0, 0.3, substeps="auto"), particles).motion
    assert found.observed["thread_0_force_x_n"].max() > 0.1
    assert np.abs(found.positions[-1] - particles.nodes).max() < 0.02


def test_tying_takes_the_length_that_ends_have_then():
    body = particles_of(bar(), 0, surface=False)
    weight = Gravity(acceleration_m_s2=[30.0, 0, 0])
    stretched = scene([thread(start_s=0.8, tighten_s=0.0, length_m=0.01)], gravity=weight)
    tensions = np.linalg.norm(run(stretched, body).motion.observed.filter(like="thread_"), axis=1)
    assert not tensions[:80].any() and tensions[80] > 1.0
    kept = scene([thread(start_s=0.8, tighten_s=10.0)], gravity=weight)
    tensions = np.linalg.norm(run(kept, body).motion.observed.filter(like="thread_"), axis=1)
    assert (
        not tensions[:80].any() and 0.0 < tensions[80] < 1e-2
    )  # it begins just taut, not with what the body has stretched


def test_the_nearest_point_is_no_farther_than_any_of_a_fine_net():
    organ = particles_of(nest("liver", liver(0.2), 0, np.array([0]), MATERIAL), 0, surface=False)
    points = organ.nodes[organ.surface][::20] + 0.01 * np.random.default_rng(2).normal(size=(7, 3))
    nodes, weights, away = nearest_on_surface(organ, points)
    found = np.einsum("ea,eai->ei", weights, organ.nodes[nodes])
    assert np.allclose(np.linalg.norm(found - points, axis=1), away, rtol=1e-12)
    net = np.array([[i, j, 40 - i - j] for i in range(41) for j in range(41 - i)]) / 40.0
    corners = organ.nodes[organ.triangles]
    for point, distance in zip(points, away, strict=True):
        brute = np.linalg.norm(np.einsum("ga,tai->tgi", net, corners) - point, axis=2).min()
        assert distance <= brute + 1e-15 and distance > brute - 0.001


def test_an_end_belongs_to_its_side_of_a_cut_and_draws_the_sides_together():
    halves = severed()
    ends = [[0.048, 0.015, 0.03], [0.052, 0.015, 0.03]]
    nodes, weights, _ = nearest_on_surface(halves, np.array(ends))
    first, second = (halves.nodes[halves.tetrahedra[np.isin(halves.tetrahedra, each).any(axis=1)]] for each in nodes)
    assert first[..., 0].max() <= 0.05 + 1e-12 and second[..., 0].min() >= 0.05 - 1e-12
    weight = Gravity(acceleration_m_s2=[0, 0, 5.0])  # which bends the sides apart on top
    sewn = scene([thread(ends_m=ends, start_s=0.4, tighten_s=0.3)], gravity=weight)
    for motion, opens in ((run(sewn, halves).motion, False), (run(sewn, halves, without="threads").motion, True)):
        tips = [np.einsum("a,fai->fi", w, motion.positions[:, n]) for n, w in zip(nodes, weights, strict=True)]
        apart = np.linalg.norm(tips[1] - tips[0], axis=1)
        assert (apart[-1] > 1.5 * 0.004) == opens
    assert apart[-1] > 0.004


@pytest.mark.parametrize(
    ("ends", "said"),
    [
        ([[0.03, 0, 0.03], [0.03, 0, 0.03]], r"threads\[0\]\.ends_m are both nearest to one point"),
        ([[0.03, 0, 0.03], [0.5, 0, 0.03]], r"threads\[0\]\.ends_m has a point 0\.4 m from the surface"),
    ],
)
def test_ends_that_are_none_are_refused(particles, ends, said):
    with pytest.raises(InputError, match=said):
        make(particles, [thread(ends_m=ends)], None)
