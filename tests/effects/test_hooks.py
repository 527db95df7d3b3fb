"""Hooks: what is grasped goes where it is moved, feels what statics say, and is let go."""

import numpy as np
import pytest
from fixtures.severed import severed

from palpate.bodies.body import nest
from palpate.bodies.material import Material
from palpate.bodies.particles import particles_of
from palpate.bodies.simple_shapes import box, sheet
from palpate.effects import settings as blocks
from palpate.effects.hooks import GRIP, make
from palpate.effects.patch_load import Patch, spread
from palpate.errors import InputError
from palpate.linalg.minimiser import minimise_by_newton
from palpate.scenes.effect_registry import effect
from palpate.scenes.run_scene import run
from palpate.scenes.settings import Scene
from palpate.solvers.equilibrium import Equilibrium
from palpate.solvers.grasping import Grasping, patch_around

MATERIAL = Material(5000.0, 0.3, 1000.0)
END, SHIFT = [0.1, 0.015, 0.015], [0.02, 0.0, 0.01]
WEIGHT = blocks.Gravity(acceleration_m_s2=[0, 0, -3.0])


def hook(**changed) -> blocks.Hook:
    given = {"at_m": END, "radius_m": 0.03, "start_s": 0.05, "pull_s": 0.1, "hold_s": 10.0, "release_s": 0.0}
    return blocks.Hook(**(given | changed))


@pytest.fixture(scope="module")
def bar():
    mesh = box([0.1, 0.03, 0.03], [6, 2, 2])
    return nest("bar", mesh, 0, np.flatnonzero(mesh.nodes[:, 0] < 1e-9), MATERIAL)


@pytest.fixture(scope="module")
def particles(bar):
    return particles_of(bar, 0, surface=False)


def scene(hooks, integrator="backward_euler", stiffness_s=0.01, duration_s=1.2, **acting) -> Scene:
    damping = blocks.Rayleigh(mass_1_s=20.0, stiffness_s=stiffness_s)
    named = {"body": "bar", "integrator": integrator, "substeps": "auto" if integrator == "symplectic_euler" else 1}
    return Scene(**named, step_s=0.01, duration_s=duration_s, **({"hooks": hooks, "rayleigh": damping} | acting))


def elements(particles):
    return effect("corotational").make(particles, None, None)


def on_hook(motion) -> np.ndarray:
    """The force on the first hook after each step, (steps, 3) [N]."""
    return motion.observed[[f"hook_0_force_{letter}_n" for letter in "xyz"]].to_numpy()


def test_force_and_stiffness_are_derivatives(particles, check_derivatives):
    pulled = hook(at_m=[0.05, 0.015, 0.03], radius_m=0.02, force_n=[0.1, 0.2, 0.3])
    beside = hook(at_m=[0.0333, 0.015, 0.03], shift_m=[0, 0, 0.01], radius_m=0.0)
    hooks = make(particles, [hook(shift_m=SHIFT, radius_m=0.02), beside, pulled], elements(particles))
    hooks.at(0.12)
    check_derivatives(hooks, particles.nodes + 1e-3 * np.random.default_rng(0).normal(size=(63, 3)), 1e-7)


METHODS = [
    ("backward_euler", {}, 0.01, 2e-4),
    ("bdf2", {}, 0.01, 2e-4),
    ("symplectic_euler", {}, 1e-3, 2e-4),
    ("projective_dynamics", {"projective_dynamics": blocks.ProjectiveDynamics(iterations=20, memory=5)}, 0.0, 1e-3),
    ("vertex_block_descent", {"vertex_block_descent": blocks.VertexBlockDescent(sweeps=20, radius=0.9)}, 0.0, 1e-3),
]


@pytest.mark.parametrize(("integrator", "own", "stiffness_s", "error"), METHODS)
def test_a_moved_patch_comes_to_the_equilibrium_of_one_that_is_held_there(
    bar, particles, integrator, own, stiffness_s, error
):
    """Against a static search in which the patch's nodes are no unknowns; the grip gives way by some 1/GRIP."""
    motion = run(scene([hook(shift_m=SHIFT)], integrator, stiffness_s, **own), particles).motion
    node = int(np.linalg.norm(particles.nodes - END, axis=1).argmin())
    problem = Grasping(bar, 0, 1, patch_around(particles, node, 0.03))
    (state,) = problem.push(np.array(SHIFT) / np.linalg.norm(SHIFT), [np.linalg.norm(SHIFT)], 1e-9)
    assert np.abs(motion.positions[-1] - state.x).max() < error * np.linalg.norm(SHIFT)
    assert np.abs(on_hook(motion)[-1] + state.force).max() < 5 * error * np.linalg.norm(state.force)
    behind = motion.positions[-1][problem.grasped] - particles.nodes[problem.grasped] - SHIFT
    assert np.abs(behind).max() < (2.0 / GRIP if integrator in ("backward_euler", "bdf2") else 1e-12) * 0.02


@pytest.mark.parametrize("integrator", ["backward_euler", "symplectic_euler"])
def test_a_force_has_the_answer_of_statics(bar, particles, integrator):
    force, disc = np.array([0.3, 0.0, 0.05]), Patch(np.array(END), np.array([1.0, 0.0, 0.0]), 0.02)
    pulled = hook(force_n=force, radius_m=0.02)
    motion = run(scene([pulled], integrator, stiffness_s=0.0), particles).motion
    problem = Equilibrium(bar, 0)
    problem.load = spread(particles, disc, force)
    static = minimise_by_newton(problem, particles.nodes, 1.0, 1e-10).x
    peak = np.linalg.norm(static - particles.nodes, axis=1).max()
    assert peak > 0.005 and np.abs(motion.positions[-1] - static).max() < 2e-3 * peak
    assert on_hook(motion)[-1] == pytest.approx(-force, abs=1e-12)


def test_between_nodes_it_grasps_the_facet_and_pulls_where_it_is(particles):
    """In a facet of the top, and on the edge of two: without a radius these move, and a force has no moment there."""
    for at, facets in (([0.041, 0.018, 0.03], 1), ([0.05, 0.0225, 0.03], 2)):
        hooks = make(particles, [hook(at_m=at, shift_m=SHIFT, radius_m=0.0)], elements(particles))
        assert len(hooks.hooks[0].triangles) == facets and len(hooks.hooks[0].nodes) == facets + 2
        for radius in (0.0, 0.003):
            pull = [0.1, 0.2, 0.3]
            hooks = make(particles, [hook(at_m=at, force_n=pull, radius_m=radius)], elements(particles))
            hooks.at(5.0)
            force = np.zeros_like(particles.nodes)
            hooks.add_force(particles.nodes, force, force)
            assert force.sum(axis=0) == pytest.approx(pull)
            moment = np.cross(particles.nodes - at, force).sum(axis=0)
            assert moment == pytest.approx(0.0, abs=1e-12)


def test_what_is_let_go_comes_back_and_feels_nothing(particles):
    gone = hook(shift_m=SHIFT, hold_s=0.1)
    back = hook(shift_m=SHIFT, hold_s=0.1, release_s=0.2)
    force = hook(force_n=[0.2, 0, 0], hold_s=0.1)
    for entry, until in ((gone, 25), (back, 45), (force, 25)):
        motion = run(scene([entry], duration_s=2.0), particles).motion
        felt = np.linalg.norm(on_hook(motion), axis=1)
        assert felt[5:until].all() and not felt[:5].any() and not felt[until:].any()
        assert np.abs(motion.positions[-1] - particles.nodes).max() < 2e-4
    assert motion.energy["hooks_j"].iloc[-1] == 0.0


def test_a_hook_takes_what_it_grasps_from_where_it_is_then(particles):
    late = hook(shift_m=[0, 0, 0.005], start_s=0.6, pull_s=0.2)
    for integrator in ("backward_euler", "symplectic_euler"):
        entry = scene([late], integrator, gravity=WEIGHT, stiffness_s=1e-3)
        height = run(entry, particles).motion.observed["hook_0_z_m"].to_numpy()
        assert height[59] < 0.013  # it sags, and then
        assert height[-1] == pytest.approx(height[59] + 0.005, abs=1e-4)
        assert np.abs(np.diff(height)).max() < 1.2 * np.abs(np.diff(height[:59])).max()


@pytest.mark.parametrize("integrator", ["backward_euler", "symplectic_euler"])
def test_what_is_pulled_against_something_stops_there(particles, integrator):
    ball = blocks.Ball(center_m=[0.13, 0.015, 0.03], radius_m=0.02)
    pulled = hook(shift_m=[0.02, 0, 0], at_m=[0.1, 0.015, 0.0], radius_m=0.016)
    contact = blocks.Contact(instruments=[ball])
    entry = scene([pulled], integrator, stiffness_s=1e-3, duration_s=0.2, contact=contact)
    motion = run(entry, particles).motion
    away = np.linalg.norm(motion.positions - ball.center_m, axis=2).min() - 0.02
    assert 0.0 < away < 0.002 and motion.observed["sphere_0_force_x_n"].iloc[-1] > 0.01
    assert np.ptp(motion.observed["hook_0_x_m"]) == pytest.approx(0.02, abs=1e-4)


def test_on_its_side_of_a_cut_alone(particles):
    halves = severed()
    for x in (0.056, 0.044):
        near = {"at_m": [x, 0.015, 0.03], "radius_m": 0.02}
        for way in ({"shift_m": [0, 0, 0.01]}, {"force_n": [0, 0, 0.1]}):
            (found,) = make(halves, [hook(**near, **way)], elements(halves)).hooks
            corners = halves.nodes[halves.tetrahedra[np.isin(halves.tetrahedra, found.nodes).any(axis=1)]]
            side = corners[..., 0] > 0.05 + 1e-12 if x > 0.05 else corners[..., 0] < 0.05 - 1e-12
            assert side.any(axis=1).all() and len(found.nodes) > 3
            assert (halves.nodes[found.nodes][:, 2] == 0.03).all()  # and of no lip
    (whole,) = make(particles, [hook(at_m=near["at_m"], shift_m=[0, 0, 0.01])], elements(particles)).hooks
    assert particles.nodes[whole.nodes][:, 0].max() > 0.06  # without a cut it reaches beyond


def test_springs_shapes_and_sheets_are_hooked_too():
    mesh = box([0.04, 0.02, 0.02], [4, 2, 2])
    held = np.flatnonzero(mesh.nodes[:, 0] < 1e-9)
    solid = particles_of(nest("bar", mesh, 0, held, MATERIAL), 0, surface=False)
    cloth = sheet([0.04, 0.02], [4, 2], 0.001)
    cloth = particles_of(nest("cloth", cloth, 0, np.flatnonzero(cloth.nodes[:, 0] < 1e-9), MATERIAL), 0, surface=False)
    damping = blocks.VelocityDamping(rate_1_s=20.0)
    for body, integrator, own in (
        (solid, "backward_euler", {"springs": blocks.Springs()}),
        (solid, "goal_position", {"shape_matching": blocks.ShapeMatching()}),
        (cloth, "backward_euler", {}),
    ):
        at = body.nodes[body.nodes[:, 0].argmax()]
        entry = hook(at_m=at, radius_m=0.0, shift_m=[0.005, 0, 0])
        pulled = scene([entry], integrator, duration_s=0.5, rayleigh=None, velocity_damping=damping, **own)
        motion = run(pulled, body).motion
        moved = motion.observed["hook_0_x_m"].iloc[-1] - motion.observed["hook_0_x_m"].iloc[0]
        assert moved == pytest.approx(0.005, rel=1e-3) and on_hook(motion)[-1, 0] < 0.0


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"at_m": [0.3, 0, 0]}, r"hooks\[0\]\.at_m is .* m from the nearest point"),
        ({"radius_m": 1.0}, r"hooks\[0\]\.radius_m is 1 m, and the whole body"),
        ({"at_m": [0.0, 0.015, 0.015]}, "which is held"),
        ({"at_m": [0.02, 0.015, 0.03]}, r"hooks\[0\] grasps nodes that are held"),
    ],
)
def test_what_cannot_be_grasped_is_refused(particles, changed, said):
    with pytest.raises(InputError, match=said):
        make(particles, [hook(shift_m=SHIFT, **changed)], elements(particles))


def test_two_hooks_do_not_move_the_same_nodes_at_once(particles):
    at_side = {"at_m": [0.085, 0.015, 0.03], "radius_m": 0.02}
    with pytest.raises(InputError, match=r"hooks\[0\] and hooks\[1\] hold the same nodes from 0.05 s on"):
        make(particles, [hook(shift_m=SHIFT), hook(shift_m=SHIFT, **at_side)], elements(particles))
    soon = hook(shift_m=SHIFT, hold_s=0.1)
    assert len(make(particles, [soon, hook(shift_m=SHIFT, start_s=0.25, **at_side)], elements(particles)).hooks) == 2
    assert len(make(particles, [soon, hook(force_n=SHIFT, **at_side)], elements(particles)).hooks) == 2
