"""Hard cases of motion: steps, masses, twists and springs at which integrators may fail, and motion in modes."""

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from scipy.linalg import expm
from scipy.spatial.distance import pdist

from palpate.bodies.body import Body
from palpate.bodies.material import Material
from palpate.bodies.particles import Particles, solid_particles
from palpate.bodies.refinement import with_midpoints
from palpate.bodies.simple_shapes import box
from palpate.effects import settings, shape_matching
from palpate.effects.effect import Force
from palpate.effects.push import placed
from palpate.models.reduced_body import BodyAtRest
from palpate.models.reduced_motion import ReducedMotion, move, prepare
from palpate.scenes.run_scene import compose, run
from palpate.solvers import goal_position
from palpate.solvers.quadratic_motion import QuadraticMotion
from palpate.solvers.system import System
from palpate.studies.hard_cases import stage
from palpate.studies.hard_cases.stage import EXPLICIT, FEM, FIRM, GRAVITY, SHAPES, SPRINGS, Answer, Case, refuses

IMPLICIT = (*FEM, *stage.SECOND, *SPRINGS)
RESIDUAL = "residual force / the weight at the end"


def motions() -> list[Case]:
    return [
        *(
            Case(f"step_of_{name}_s", f"a firm bar begins to sag under gravity in 100 steps of {name} s",
                 "the exact motion of its linear system", "largest error / the largest displacement", bound,
                 partial(_begins_to_sag, h), (*IMPLICIT, *EXPLICIT),
                 source="Li et al. 2020 (IPC), time steps", bounds=bounds)
            for name, h, bound, bounds in (("1e-5", 1e-5, 0.03, {}), ("5e-4", 5e-4, 0.05, {"fem_explicit": 0.035}))
        ),
        Case("step_of_0.1_s", "a firm bar sags under gravity for 10 s in steps of 0.1 s, with substeps: auto",
             "equilibrium", RESIDUAL, 0.02, lambda model: _sag(model, 0.1, FIRM), (*IMPLICIT, *EXPLICIT),
             source="Li et al. 2020 (IPC), time steps"),
        Case("step_of_2_s", "the same for 200 s in steps of 2 s", "equilibrium", RESIDUAL, 0.02,
             lambda model: _sag(model, 2.0, FIRM), IMPLICIT, source="Li et al. 2020 (IPC), time steps"),
        Case("goals_step_of_2_s", "a held bar is released at twice its length, in steps of 2 s",
             "the motion in steps of 1e-5 s, step by step, and then rest",
             "largest distance between the motions / their start's from rest", 1e-6, _released, SHAPES,
             source="Müller et al. 2005"),
        Case("mass_ratio", "one half of a free body is a million times as heavy; the body receives a velocity",
             "momentum is conserved", "change of momentum, or of the centre's motion / sum of the nodes' momenta", 1e-7,
             _heavy, IMPLICIT),
        Case("heavy_half", "one half of a free body is a million times as heavy, the other receives a velocity",
             "it returns to its shape, and its centre drifts", "largest relative error of edges or of the centre's way",
             0.04, _heavy_half, (*IMPLICIT, *SHAPES)),
        Case("twisted_10_turns", "a free rod starts twisted by ten turns, and drifts", "it unwinds to its rest shape",
             "largest relative error of edges or of the centre's way after 20 s", 0.02, _unwind, (*FEM, *SHAPES)),
        Case("twisting_10_turns", "the ends of a rod are turned against each other by 10.25 turns in 205 steps",
             "an equilibrium between the ends", "residual force / the force on an end", 1e-3, _wind,
             (*FEM, *SPRINGS), source="Li et al. 2020 (IPC), twist"),
        Case("stiff", "a bar of 1e12 Pa with a step 10 000 times too long for explicit integrators", "equilibrium",
             RESIDUAL, 0.02, _stiff, IMPLICIT),
        Case("stiff_refused", "the same without substeps", "refused", "none", 0.0,
             refuses(lambda: _stiff("springs_explicit")), ("springs_explicit",), ("refused",)),
        Case("stiff_unstable", "the same with allow_unstable: true", "it diverges, and that is reported", "none", 0.0,
             lambda model: _stiff(model, allow_unstable=True), EXPLICIT, ("not_converged",)),
        *(
            Case(f"flat_rest_{name}", f"shape matching of particles whose rest shape is a {name}, and which drift",
                 "their rest shape, where the drift takes them",
                 "largest error of a distance between two particles, or of the centre's way / those", 1e-3,
                 partial(_degenerate, axes), SHAPES, source="Müller et al. 2005")
            for name, axes in {"point": [0, 0, 0], "line": [1, 0, 0], "plane": [1, 1, 0]}.items()
        ),
        Case("one_particle", "shape matching of a single moving particle", "uniform motion",
             "position error / distance travelled", 1e-12, _alone, SHAPES, source="Müller et al. 2005"),
        *modes(),
    ]  # fmt: skip


def _begins_to_sag(h: float, model: str) -> Answer:
    """Step a bar under gravity 100 times from rest, and compare with the exact motion of the linearised system."""
    particles = stage.bar_particles(material=FIRM)
    stepper, rest = stage.Stepper(model, particles, {"held": True} | GRAVITY), particles.nodes
    moved, _ = stepper.advance(rest, np.zeros_like(rest), h, 100)
    expected = linear_displacement(stepper.system, 100 * h)
    peak = float(np.linalg.norm(expected, axis=1).max())
    return Answer(moved, rest, lambda a: float(np.linalg.norm(a - rest - expected, axis=1).max()) / peak)


def linear_displacement(system: System, time_s: float) -> np.ndarray:
    """Compute the displacement (n, 3) [m] that the weight causes within ``time_s`` of the system linearised at rest.

    The state (displacement u, velocity, 1) of free nodes obeys a linear equation, solved by a matrix exponential.
    """
    rest, free = system.particles.nodes, np.repeat(system.free, 3)
    inverse_masses = 1.0 / np.repeat(system.masses, 3)[free, None]
    matrices = (system.stiffness(rest, True), system.damping(rest))
    zeros, identity = np.zeros((free.sum(), free.sum())), np.eye(int(free.sum()))
    stiffness, damping = (zeros if m is None else inverse_masses * m.toarray()[np.ix_(free, free)] for m in matrices)
    load = inverse_masses * stage.weight(system).reshape(-1, 1)[free]
    rows = [zeros, identity, 0.0 * load], [-stiffness, -damping, load], [0.0 * load.T, 0.0 * load.T, np.zeros((1, 1))]
    u = np.zeros(len(free))
    u[free] = expm(time_s * np.block([list(row) for row in rows]))[: len(identity), -1]
    return u.reshape(rest.shape)


def _sag(model: str, h: float, material: Material, **stepping: Any) -> Answer:
    """Simulate a bar under gravity over 100 steps of ``h`` [s], and judge its end by the residual force."""
    effects = {"held": True} | GRAVITY | (stage.MASS_DAMPING if model in EXPLICIT else {})
    scene = stage.scene_of(model, h, 100 * h, effects, **({"substeps": "auto"} | stepping))
    particles = stage.bar_particles(material=material)
    settled = run(scene, particles).motion.positions[-1]
    system = compose(scene, particles)
    return Answer(settled, particles.nodes, lambda a: stage.residual_of_weight(system, a))


def _lopsided() -> tuple[Particles, np.ndarray]:
    """Make a free bar whose left half is a million times as heavy; return it and the mask (n,) of that half's nodes."""
    particles = stage.bar_particles(held=False)
    heavy = particles.nodes[:, 0] < 0.1
    return replace(particles, masses=np.where(heavy, 1e6, 1.0) * particles.masses), heavy


def _heavy(model: str) -> Answer:
    """Throw both halves of the lopsided bar, and judge its momentum."""
    particles, heavy = _lopsided()
    return stage.free_flight(model, particles, np.where(heavy[:, None], [0.0, 1e-6, 0.0], [0.0, 0.0, 1.0]), 1e-9)


def _heavy_half(model: str) -> Answer:
    """Throw the light half of the lopsided bar, and judge the shape and the centre of mass after 20 s."""
    particles, heavy = _lopsided()
    v, masses = np.where(heavy[:, None], 0.0, [0.0, 0.0, 1.0]), particles.masses
    step_s, steps = stage.RECOVERY_STEPS[model not in SHAPES]
    reached, _ = stage.Stepper(model, particles).advance(particles.nodes, v, step_s, steps)
    drift = stage.coasting_distance(model, step_s, steps) * (masses @ v) / masses.sum()

    def error(a: np.ndarray) -> float:
        centre_error = np.linalg.norm(masses @ (a - particles.nodes) / masses.sum() - drift) / np.linalg.norm(drift)
        return max(stage.edge_error(particles, a), float(centre_error))

    return Answer(reached, particles.nodes, error)


def _rotated(x: np.ndarray, angle: np.ndarray | float) -> np.ndarray:
    """Rotate ``x`` (n, 3) [m] by ``angle`` [rad], one or (n,), about the axis of the rod."""
    y, z = (x[:, 1:] - 0.025).T
    c, s = np.cos(angle), np.sin(angle)
    return np.column_stack([x[:, 0], c * y - s * z + 0.025, s * y + c * z + 0.025])


def _unwind(model: str) -> Answer:
    """Release a rod that is twisted by ten turns."""
    particles = stage.bar_particles(held=False)
    return stage.recovery(model, particles, _rotated(particles.nodes, 20.0 * np.pi * particles.nodes[:, 0] / 0.2))


def _wind(model: str) -> Answer:
    """Rotate the held ends of a rod by 9° in opposite directions in each step, then take long steps to equilibrium."""
    mesh = box([0.2, 0.05, 0.05], [8, 2, 2])
    end_nodes = np.flatnonzero(np.isin(mesh.nodes[:, 0], (0.0, 0.2)))
    particles = solid_particles(mesh, end_nodes, stage.SOFT, "rod")
    stepper, x, v = stage.Stepper(model, particles, {"held": True}), mesh.nodes.copy(), np.zeros_like(mesh.nodes)
    angle_per_step = np.where(mesh.nodes[end_nodes, 0] > 0.1, 1.0, -1.0) * np.pi / 20.0
    for _ in range(205):
        x = x.copy()
        x[end_nodes] = _rotated(x[end_nodes], angle_per_step)
        x, v = stepper.advance(x, v, 0.05, 1)
    straight = mesh.nodes.copy()
    straight[end_nodes] = x[end_nodes]
    for step_s, steps in ((0.2, 50), (2.0, 20), (100.0, 10)):
        x, v = stepper.advance(x, v, step_s, steps)
    (_, elastic), *_ = stepper.system.offering(Force)
    force = np.zeros_like(x)
    elastic.add_force(x, np.zeros_like(x), force)
    on_end = float(np.linalg.norm(force[mesh.nodes[:, 0] == 0.0]))
    residual = stepper.system.potential_force
    return Answer(x, straight, lambda a: float(np.linalg.norm(residual(a))) / on_end)


def _stiff(model: str, **stepping: Any) -> Answer:
    return _sag(model, 1e-2, Material(1e12, 0.3, 1000.0), **({"substeps": 1} | stepping))


def _released(model: str) -> Answer:
    """Release a held bar from twice its length; the answer is its positions after 2, 5, 10 and 1000 steps of 2 s.

    They have to be those in steps of 1e-5 s, as the motion of goal positions does not depend on the step, and rest.
    """
    particles, motions = stage.bar_particles(), []
    start = particles.nodes * [2.0, 1.0, 1.0]
    for step_s in (1e-5, 2.0):
        effects = {"held": True, "velocity_damping": {"rate_1_s": 0.05 / step_s}}  # 5 % damping in a step of any length
        stepper, x, v, positions = stage.Stepper(model, particles, effects), start, np.zeros_like(start), []
        for steps in (2, 3, 5, 990):
            x, v = stepper.advance(x, v, step_s, steps)
            positions.append(x)
        motions.append(np.array(positions))
    expected, scale = motions[0], float(np.abs(start - particles.nodes).max())
    expected[-1] = particles.nodes
    return Answer(motions[1], start, lambda a: float(np.abs(a - expected).max()) / scale, zero=particles.nodes)


def _degenerate(axes: list[int], model: str) -> Answer:
    """Release random particles whose rest shape has an extent along the ``axes`` that are 1 only."""
    scattered = np.random.default_rng(4).uniform(-0.1, 0.1, (20, 3))
    particles = stage.point_masses("cloud", scattered * axes)

    def error(a: np.ndarray) -> float:
        return float(np.abs(pdist(a) - pdist(particles.nodes)).max() / pdist(scattered).max())

    return stage.recovery(model, particles, scattered, stage.one_cluster(model), error)


def _alone(model: str) -> Answer:
    """Step a single moving particle under shape matching."""
    particles = stage.point_masses("dot", np.zeros((1, 3)))
    matching = settings.ShapeMatching(**stage.one_cluster(model)["shape_matching"])
    integrator = goal_position.make(System(particles, {"shape_matching": shape_matching.make(particles, matching)}))
    x, v = np.zeros((1, 3)), np.array([[1.0, 2.0, 3.0]])
    for _ in range(100):
        x, v = integrator.step(x, v, 0.01)
    return Answer(x, np.zeros((1, 3)), lambda a: float(np.abs(a - [1.0, 2.0, 3.0]).max()))


MODELS = ("moving_modes",)
NEWTONS = 0.01
"""A push on the tip that moves it by a tenth of the bar's length."""
MEASURE, ELEMENTS = "RMSE over frames and nodes / the largest displacement", "the motion of quadratic elements"
DURATION_S, FRAMES = 0.5, 25
RAYLEIGH = settings.Rayleigh(mass_1_s=0.0, stiffness_s=0.05)


def modes() -> list[Case]:
    def case(name: str, scene: str, body: Body, times: float, expected: str = ELEMENTS, **more: Any) -> Case:
        return Case(name, scene, expected, MEASURE, 0.01, lambda model: _pushed(body, times), MODELS, **more)

    return [
        *(
            case(f"modes_load_times_{k}", f"a bar is pushed by {k} times what moves its tip by a tenth of its length, "
                 "and let go", stage.bar_body(0), k)
            for k in (2, 3, 50)
        ),
        Case("modes_of_another_body", "the same bar, twice as stiff", "refused", MEASURE, 0.01,
             refuses(lambda: BodyAtRest(stage.bar_body(0), 10).check(stage.bar_body(0, FIRM))), MODELS, ("refused",)),
        case("modes_slivers", "a bar with a layer of elements of 0.1° is pushed and let go",
             stage.bar_body(0, degrees=0.1), 1),
        case("modes_incompressible", "a bar of Poisson's ratio 0.49, whose points have no energy of their own",
             stage.bar_body(0, Material(3000.0, 0.49, 1000.0)), 1, "refusal is reported", declared=("not_converged",)),
    ]  # fmt: skip


def _push(body: Body, times: float) -> settings.Loads:
    """Describe a push of the bar's free end by ``times`` NEWTONS, which rises, stays and ends."""
    force_n = [0.0, 0.2 * times * NEWTONS, -times * NEWTONS]
    at_m = [0.2, 0.025, 0.05]
    load = settings.Load(at_m=at_m, force_n=force_n, radius_m=0.02, press_s=0.15, hold_s=0.1, release_s=0.05)
    return settings.Loads(push=settings.Push(loads=placed(body.fine, body.anchors[-1], body.name, [load])))


def _pushed(body: Body, times: float) -> Answer:
    """Push a body and let it go, in modes, and compare with quadratic elements of the next level in the same steps."""
    loads, step_s, surface = _push(body, times), DURATION_S / (2 * FRAMES), body.fine.surface
    reduced = prepare(BodyAtRest(body, 10), loads, RAYLEIGH, 3, 0.02)
    frames = move(ReducedMotion(reduced, loads, RAYLEIGH), DURATION_S, FRAMES, 2 * FRAMES).moved
    elements = QuadraticMotion(with_midpoints(body, 1), 1, loads, RAYLEIGH)
    steps = list(elements.steps(step_s, 2 * FRAMES, 1e-3))[1::2]
    expected = np.array([(reached.x - elements.rest)[surface] for reached in steps])
    peak = float(np.linalg.norm(expected, axis=2).max())

    def error(a: np.ndarray) -> float:
        return float(np.sqrt(np.mean(np.sum((a - expected) ** 2, axis=2)))) / peak

    return Answer(frames, np.zeros_like(frames), error)
