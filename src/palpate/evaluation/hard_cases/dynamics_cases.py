"""Hard cases of motion: steps, masses, twists and springs at which integrators may become unstable."""

from dataclasses import replace
from typing import Any

import numpy as np

from palpate.bodies.box import box
from palpate.bodies.material import Material
from palpate.bodies.particles import Particles, solid_particles
from palpate.effects.shape_matching import goal_shapes
from palpate.evaluation.hard_cases.hard_case import Case, finite
from palpate.evaluation.hard_cases.stage import (
    EXPLICIT,
    FEM,
    FIRM,
    MODELS,
    SHAPES,
    SOFT,
    SPRINGS,
    Stepper,
    bar,
    edge_error,
    play,
)
from palpate.scenes.motion import Motion
from palpate.solvers import goal_position
from palpate.solvers.system import System

IMPLICIT = (*FEM, *SPRINGS)
STEPS_S = {"1e-5": 1e-5, "5e-4": 5e-4, "0.1": 0.1, "2": 2.0}
GRAVITY = {"acceleration_m_s2": [0.0, 0.0, -9.81]}
REACH = "largest distance of a node from rest / the body's size"
AXES = {"point": [0, 0, 0], "line": [1, 0, 0], "plane": [1, 1, 0]}


def cases() -> list[Case]:
    """Return the declared cases of this family."""

    def case(name, scene, expected, measure, bound, run, models, declared=None, source="palpate"):
        words = (name, "dynamics", source, scene, expected, measure, bound)
        return Case.of(*words, run=run, models=models, declared=declared)

    refused = dict.fromkeys(EXPLICIT, ("refused",))
    return [
        *(
            case(f"step_of_{name}_s", f"a firm bar sags under gravity in 100 steps of {name} s",
                 "bounded motion, or the step is refused", REACH, 1.0, lambda model, h=h: _sag(model, h),
                 (*IMPLICIT, *EXPLICIT), refused if h > 1e-3 else None, source="Li et al. 2020 (IPC), time steps")
            for name, h in STEPS_S.items()
        ),
        *(
            case(f"goals_step_of_{name}_s", f"a held bar is released at twice its length, 1000 steps of {name} s",
                 "it returns to rest for every step", "largest relative edge error at the end", 1e-6,
                 lambda model, h=h: _released(model, h), SHAPES, source="Müller et al. 2005")
            for name, h in STEPS_S.items()
        ),
        case("mass_ratio", "one half of a free body is a million times as heavy; the body receives a velocity",
             "momentum is conserved", "change of momentum / sum of the nodes' momenta", 1e-7, _heavy, IMPLICIT),
        case("heavy_half", "one half of a free body is a million times as heavy; the other receives a velocity",
             "it returns to its shape", "largest relative edge error after 20 s", 0.05, _heavy_half,
             (*IMPLICIT, *SHAPES)),
        case("twisted_10_turns", "a free rod starts twisted by ten turns", "it unwinds to its rest shape",
             "largest relative edge error after 20 s", 0.02, _unwind, (*FEM, *SHAPES)),
        case("twisting_10_turns", "both ends of a rod are turned against each other, ten turns in all",
             "each of the 200 steps of 18° converges", "largest distance from the axis / the rod's width", 1.0, _wind,
             (*FEM, *SPRINGS), source="Li et al. 2020 (IPC), twist"),
        case("stiff_refused", "a bar of 1e12 Pa with a step 10 000 times too long for explicit integrators",
             "refused by explicit integrators, else stable", REACH, 1.0, _stiff, (*IMPLICIT, *EXPLICIT), refused),
        case("stiff_unstable", "the same with allow_unstable: true", "it diverges, and that is reported", REACH, 1.0,
             lambda model: _stiff(model, allow_unstable=True), EXPLICIT, dict.fromkeys(EXPLICIT, ("not_converged",))),
        *(
            case(f"flat_rest_{name}", f"shape matching of particles whose rest shape is a {name}",
                 "bounded motion", "largest distance from the centre after 2000 steps / that at the start", 3.0,
                 lambda model, name=name: _degenerate(model, AXES[name]), SHAPES,
                 source="Müller et al. 2005")
            for name in AXES
        ),
        case("one_particle", "shape matching of a single moving particle", "uniform motion",
             "position error / distance travelled", 1e-12, _alone, SHAPES, source="Müller et al. 2005"),
    ]  # fmt: skip


def _sag(model: str, h: float, **rest: Any) -> float:
    more = {"held": None, "gravity": GRAVITY}
    return _reach(play(model, bar(material=FIRM), h, 100 * h, more, **rest))


def _reach(motion: Motion) -> float:
    finite(motion.positions)
    far = np.linalg.norm(motion.positions - motion.rest, axis=2).max()
    return float(far / np.ptp(motion.rest, axis=0).max())


def _lopsided() -> tuple[Particles, np.ndarray]:
    """Return a free bar whose left half has a million times the mass, and the mask (n,) of that half's nodes."""
    particles = bar(held=False)
    heavy = particles.nodes[:, 0] < 0.1
    return replace(particles, masses=np.where(heavy, 1e6, 1.0) * particles.masses), heavy


def _heavy(model: str) -> float:
    particles, heavy = _lopsided()
    v = np.where(heavy[:, None], 0.0, [0.0, 0.0, 1.0]) + np.where(heavy[:, None], [0.0, 1e-6, 0.0], 0.0)
    masses = particles.masses[:, None]
    after = Stepper(model, particles, tolerance=1e-9).go(particles.nodes, v, 0.01, 20)[1]
    return float(np.linalg.norm((masses * (after - v)).sum(axis=0)) / np.linalg.norm(masses * v, axis=1).sum())


def _heavy_half(model: str) -> float:
    particles, heavy = _lopsided()
    v = np.where(heavy[:, None], 0.0, [0.0, 0.0, 1.0])
    step_s, steps = (0.01, 2000) if model in SHAPES else (0.05, 400)
    return edge_error(particles, Stepper(model, particles).go(particles.nodes, v, step_s, steps)[0])


def _turned(x: np.ndarray, angle: np.ndarray | float) -> np.ndarray:
    """Rotate ``x`` (n, 3) [m] by ``angle`` [rad], one or (n,), about the axis of the rod."""
    y, z = (x[:, 1:] - 0.025).T
    c, s = np.cos(angle), np.sin(angle)
    return np.column_stack([x[:, 0], c * y - s * z + 0.025, s * y + c * z + 0.025])


def _unwind(model: str) -> float:
    particles = bar(held=False)
    x = _turned(particles.nodes, 20.0 * np.pi * particles.nodes[:, 0] / 0.2)
    step_s, steps = (0.01, 2000) if model in SHAPES else (0.05, 400)
    return edge_error(particles, Stepper(model, particles).go(x, np.zeros_like(x), step_s, steps)[0])


def _wind(model: str) -> float:
    """Rotate the held nodes of both ends by 9° in opposite directions in each step."""
    mesh = box([0.2, 0.05, 0.05], [8, 2, 2])
    ends = np.flatnonzero(np.isin(mesh.nodes[:, 0], (0.0, 0.2)))
    particles = solid_particles(mesh, ends, SOFT, "rod")
    stepper, x, v = Stepper(model, particles, {"held": None}), mesh.nodes.copy(), np.zeros_like(mesh.nodes)
    way = np.where(mesh.nodes[ends, 0] > 0.1, 1.0, -1.0) * np.pi / 20.0
    for _ in range(200):
        x = x.copy()
        x[ends] = _turned(x[ends], way)
        x, v = stepper.go(x, v, 0.05, 1)
    return float(np.linalg.norm(x[:, 1:] - 0.025, axis=1).max()) / 0.05


def _stiff(model: str, **rest: Any) -> float:
    stiff = Material(1e12, 0.3, 1000.0)
    return _reach(play(model, bar(material=stiff), 1e-2, 1.0, {"held": None, "gravity": GRAVITY}, **rest))


def _released(model: str, h: float) -> float:
    particles = bar()
    x = particles.nodes * [2.0, 1.0, 1.0]
    more = {"held": None, "velocity_damping": {"rate_1_s": 0.05 / h}}  # 5 % damping per step for every step size
    return edge_error(particles, Stepper(model, particles, more).go(x, np.zeros_like(x), h, 1000)[0])


def _degenerate(model: str, axes: list[int]) -> float:
    random = np.random.default_rng(4).uniform(-0.1, 0.1, (20, 3))
    one = {"shape_matching": MODELS[model][1]["shape_matching"] | {"clusters": {"kind": "one"}}}
    none = np.empty((0, 3), dtype=int), np.empty((0, 4), dtype=int)
    particles = Particles("cloud", random * axes, np.ones(20), np.array([], dtype=int), *none, SOFT)
    x, _ = Stepper(model, particles, one).go(random, np.zeros_like(random), 0.01, 2000)
    return float(np.abs(x - x.mean(axis=0)).max() / np.abs(random - random.mean(axis=0)).max())


def _alone(model: str) -> float:
    none = np.empty((0, 3), dtype=int), np.empty((0, 4), dtype=int)
    particles = Particles("dot", np.zeros((1, 3)), np.ones(1), np.array([], dtype=int), *none, SOFT)
    settings = MODELS[model][1]["shape_matching"] | {"clusters": {"kind": "one"}}
    integrator = goal_position.make(System(particles, {"shape_matching": goal_shapes.make(particles, settings)}), {})
    x, v = np.zeros((1, 3)), np.array([[1.0, 2.0, 3.0]])
    for _ in range(100):
        x, v = integrator.step(x, v, 0.01)
    finite(x)
    return float(np.abs(x - [1.0, 2.0, 3.0]).max())
