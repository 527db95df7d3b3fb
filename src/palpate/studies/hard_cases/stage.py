"""The record of a hard case, how its outcomes are judged, and the bodies, models and runs that cases share."""

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from palpate.bodies.body import Body, nest
from palpate.bodies.material import Material
from palpate.bodies.mesh import Mesh, TetMesh
from palpate.bodies.organs import liver
from palpate.bodies.particles import Particles, solid_particles
from palpate.bodies.simple_shapes import box
from palpate.effects.effect import Weight
from palpate.effects.elements import Elements
from palpate.errors import InputError, NotConverged
from palpate.scenes import effect_registry
from palpate.scenes.run_scene import compose
from palpate.scenes.settings import Scene
from palpate.solvers.system import System

OUTCOMES = ("stable", "refused", "not_converged", "wrong", "nan")
"""All outcomes: ``nan`` is never acceptable, ``refused`` and ``not_converged`` only where declared.

``wrong`` may be declared for a model whose fault is known, as that of elements that lock; it counts as wrong.
"""
WRONG = ("frozen", "zero", "tenth")
"""Deliberately wrong answers (``Answer.wrong_errors``) whose errors must exceed the bound of a case."""
NEARLY = "twentieth"
"""A wrong answer whose error must exceed the bound, too, except for the models that a case lists as ``blunt``."""
SCALED = {"tenth": 0.1, NEARLY: 0.05}
"""By how much, relatively, two wrong answers are too far from the origin of an answer, or too near to it."""
UNMEASURABLE = 1e9
"""Largest error that is tabulated for a wrong answer; also the error of one that raises or is not finite."""


@dataclass(frozen=True, eq=False)
class Answer:
    """The answer of a model to a case, and the function that measures the error of this or any other answer.

    values : the answer, an array of any shape
    frozen : the answer of a solver that returns its input unchanged, broadcast to the shape of ``values``
    error : function from an answer to the number that the case bounds
    zero : the answer of no displacement, by default ``frozen``
    origin : the point from which the answers of SCALED are scaled, by default ``frozen``
    """

    values: np.ndarray
    frozen: np.ndarray
    error: Callable[[np.ndarray], float]
    zero: np.ndarray | None = None
    origin: np.ndarray | None = None

    def wrong_errors(self) -> dict[str, float]:
        """Compute the error of each deliberately wrong answer by its name: those of WRONG, and NEARLY.

        Of an answer that is scaled, once up and once down, the smaller error counts.
        """
        offset = self.values - (self.frozen if self.origin is None else self.origin)
        answers = {"frozen": [self.frozen], "zero": [self.frozen if self.zero is None else self.zero]}
        for name, factor in SCALED.items():
            answers[name] = [self.values - factor * offset, self.values + factor * offset]
        shape = self.values.shape
        return {name: min(self._error(np.broadcast_to(each, shape)) for each in some) for name, some in answers.items()}

    def _error(self, answer: np.ndarray) -> float:
        try:
            with np.errstate(all="ignore"):
                value = float(self.error(answer))
        except (ArithmeticError, InputError, NotConverged):
            return UNMEASURABLE
        return min(value, UNMEASURABLE) if math.isfinite(value) else UNMEASURABLE


@dataclass(frozen=True, eq=False)
class Case:
    """A situation in which numerics may fail, with the outcome that was declared before any model was tried.

    scene, expected, measure : the situation, the behaviour of a good model and the meaning of the error, in words
    run : function from the name of one of ``models`` to its ``Answer``
    bound : largest error of a stable answer; the errors of WRONG answers must exceed it
    declared : acceptable outcomes of all models, or by model; models that are not named must be stable
    source : who thought of the case
    bounds : bounds of single models, in place of ``bound``
    blunt : models with so large an own error that the bound cannot exclude the answer NEARLY
    """

    name: str
    scene: str
    expected: str
    measure: str
    bound: float
    run: Callable[[str], Answer]
    models: Collection[str]
    declared: tuple[str, ...] | Mapping[str, tuple[str, ...]] = ("stable",)
    source: str = "palpate"
    bounds: Mapping[str, float] = field(default_factory=dict)
    blunt: Collection[str] = ()

    def acceptable(self, model: str) -> tuple[str, ...]:
        """Return the outcomes that are declared acceptable for a model."""
        return self.declared if isinstance(self.declared, tuple) else self.declared.get(model, ("stable",))


def refuses(action: Callable[[], object]) -> Callable[[str], Answer]:
    """Return the ``run`` of a case in which ``action`` has to raise InputError, whatever the model."""

    def run(model: str) -> Answer:
        action()
        raise AssertionError("not refused")

    return run


def check_finite(*arrays: np.ndarray) -> None:
    """Raise FloatingPointError, which ``judge`` calls the outcome ``nan``, if a value of ``arrays`` is not finite."""
    for array in arrays:
        if not np.isfinite(array).all():
            raise FloatingPointError("a value that was returned is not finite")


def judge(case: Case, model: str) -> dict:
    """Run one model in one case, and return its row of hard_cases.csv, without the column ``family``.

    InputError is the outcome ``refused``, NotConverged ``not_converged``, FloatingPointError ``nan``, and any other
    exception ``wrong``, since a crash is no refusal; ``message`` is its text. Errors of wrong answers are NaN where the
    model gave no answer. ``sharp`` says whether all of WRONG exceed the bound; it is empty unless the answer is stable.
    """
    value, message, errors = math.nan, "", dict.fromkeys((*WRONG, NEARLY), math.nan)
    bound = case.bounds.get(model, case.bound)
    try:
        answer = case.run(model)
        check_finite(answer.values)
        value = float(answer.error(answer.values))
        errors = answer.wrong_errors()
    except InputError as error:
        outcome, message = "refused", str(error)
    except NotConverged as error:
        outcome, message = "not_converged", str(error)
    except FloatingPointError as error:
        outcome, message = "nan", str(error)
    except Exception as error:
        outcome, message = "wrong", f"{type(error).__name__}: {error}"
    else:
        outcome = "nan" if not math.isfinite(value) else "stable" if value <= bound else "wrong"
    sharp = all(errors[name] > bound for name in WRONG) if outcome == "stable" else None
    return {
        "case": case.name,
        "source": case.source,
        "scene": case.scene,
        "model": model,
        "outcome": outcome,
        "measure": case.measure,
        "value": value,
        "bound": bound,
        **errors,
        "sharp": sharp,
        "declared": " or ".join(case.acceptable(model)),
        "passed": outcome in case.acceptable(model) and sharp is not False,
        "message": message,
    }


SOFT = Material(3000.0, 0.3, 1000.0)
FIRM = Material(1e5, 0.3, 1000.0)
GRAVITY = {"gravity": {"acceleration_m_s2": [0.0, 0.0, -9.81]}}
MASS_DAMPING = {"rayleigh": {"mass_1_s": 5.0, "stiffness_s": 0.0}}
"""Damping of bodies that come to rest in explicit steps."""

Described = tuple[str, dict[str, Any]]
"""Name of an integrator, and the blocks of effects that go with it."""


def _shapes(mode: str) -> Described:
    clusters = {"kind": "cubes", "edge_m": 0.06, "overlap": 0.5}
    matching = {"mode": mode, "clusters": clusters}
    return "goal_position", {"shape_matching": matching, "velocity_damping": {"rate_1_s": 5.0}}


_ELEMENTS = {"rayleigh": {"mass_1_s": 0.0, "stiffness_s": 0.05}}
_SPRINGS = {"springs": {}, "volume": {}, "kelvin": {"ratio": 0.1}}
_SHEET = {"bending": {}, "rayleigh": {"mass_1_s": 2.0, "stiffness_s": 0.0}}
FEM: dict[str, Described] = {"fem_implicit": ("backward_euler", _ELEMENTS)}
SECOND: dict[str, Described] = {"fem_bdf2": ("bdf2", _ELEMENTS)}
SPRINGS: dict[str, Described] = {"springs_implicit": ("backward_euler", _SPRINGS)}
EXPLICIT: dict[str, Described] = {
    "springs_explicit": ("symplectic_euler", _SPRINGS),
    "fem_explicit": ("symplectic_euler", MASS_DAMPING),
}
SHAPES = {f"shapes_{mode}": _shapes(mode) for mode in ("rigid", "linear", "quadratic")}
SHEETS: dict[str, Described] = {"sheet_implicit": ("backward_euler", _SHEET)}
MODELS = FEM | SECOND | SPRINGS | EXPLICIT | SHAPES | SHEETS
"""Integrator and blocks of effects of each moving model."""


def bar_mesh(degrees: float = 0.0) -> TetMesh:
    """Mesh a bar of 0.2 m × 0.05 m × 0.05 m by 192 tetrahedra; unless 0, ``degrees`` are angles of a layer more."""
    planes = np.linspace(0.0, 0.2, 9)
    if degrees:
        planes = np.insert(planes, 4, 0.075 + 0.025 * np.tan(np.radians(degrees)))
    mesh = box([len(planes) - 1.0, 0.05, 0.05], [len(planes) - 1, 2, 2])
    x = np.interp(mesh.nodes[:, 0], np.arange(len(planes)), planes)
    return TetMesh(np.column_stack([x, mesh.nodes[:, 1:]]), mesh.tetrahedra)


def bar_body(refined: int, material: Material = SOFT, degrees: float = 0.0, held: bool = True) -> Body:
    """Make a body of ``bar_mesh``, refined ``refined`` times, whose end at x = 0 is ``held`` or free."""
    mesh = bar_mesh(degrees)
    return nest("bar", mesh, refined, _end(mesh) if held else _end(mesh)[:0], material)


def bar_particles(held: bool = True, material: Material = SOFT) -> Particles:
    """Make the particles of ``bar_mesh``, whose end at x = 0 is ``held`` or free."""
    mesh = bar_mesh()
    return solid_particles(mesh, _end(mesh) if held else _end(mesh)[:0], material, "bar")


def _end(mesh: TetMesh) -> np.ndarray:
    return np.flatnonzero(mesh.nodes[:, 0] == 0.0)


def shipped_liver(material: Material = SOFT) -> Body:
    """Make the coarse mesh of the liver of the shipped config, held at its back."""
    mesh = liver(0.2)
    held = np.flatnonzero(np.linalg.norm(mesh.nodes - [-0.03, 0.05, 0.03], axis=1) <= 0.04)
    return nest("liver", mesh, 0, held, material)


def point_masses(name: str, nodes: np.ndarray, held: Sequence[int] = ()) -> Particles:
    """Make particles of 1 kg at ``nodes`` (n, 3) [m], without a surface and without elements."""
    none = np.empty((0, 3), dtype=int), np.empty((0, 4), dtype=int)
    return Particles(name, nodes, np.ones(len(nodes)), np.array(held, dtype=int), *none, SOFT)


def scene_of(model: str, step_s: float, duration_s: float, more: dict[str, Any] | None = None, **fields: Any) -> Scene:
    """Describe a scene of one of MODELS with ``more`` effects and other ``fields``; the body is free unless held."""
    integrator, blocks = MODELS[model]
    stepping = {"integrator": integrator, "step_s": step_s, "duration_s": duration_s}
    names = {"name": "hard_case", "body": "body", "held": False}
    return Scene.model_validate(names | stepping | blocks | (more or {}) | fields)


def one_cluster(model: str) -> dict[str, Any]:
    """Return the block ``shape_matching`` of one of SHAPES, with a single cluster in place of several."""
    return {"shape_matching": MODELS[model][1]["shape_matching"] | {"clusters": {"kind": "one"}}}


class Stepper:
    """Time integration of one of MODELS, with ``more`` effects, from any state."""

    def __init__(self, model: str, particles: Particles, more: dict[str, Any] | None = None, tolerance: float = 1e-8):
        scene = scene_of(model, 1.0, 1.0, more, tolerance=tolerance)
        self.system = compose(scene, particles)
        self.integrator = effect_registry.integrator(scene.integrator).make(self.system, scene)

    def advance(self, x: np.ndarray, v: np.ndarray, step_s: float, steps: int) -> tuple[np.ndarray, np.ndarray]:
        """Compute the positions (n, 3) [m] and velocities (n, 3) [m/s] after ``steps`` steps from the state x, v.

        Sets ``energy_gain`` [J]: the most that the total energy less the work of loads rose above its first value; 0
        for shape matching, which has no energy.
        """
        has_energy = "shape_matching" not in self.system.effects
        start_energy = self.total_energy(x, v) - self.system.work_j if has_energy else 0.0
        self.energy_gain = 0.0
        for number in range(steps):
            self.system.at((number + 1) * step_s)
            x, v = self.integrator.step(x, v, step_s)
            check_finite(x, v)
            self.system.relax(x, step_s)
            if has_energy:
                self.energy_gain = max(self.energy_gain, self.total_energy(x, v) - self.system.work_j - start_energy)
        return x, v

    def total_energy(self, x: np.ndarray, v: np.ndarray) -> float:
        """Return the sum of kinetic and potential energy [J]."""
        return 0.5 * float(np.vdot(self.system.masses[:, None] * v, v)) + self.system.energy(x)


class NodalForce:
    """A constant force of 1 N along x, or ``newtons`` (3,), distributed over nodes by ``weights`` (n,)."""

    outer = True

    def __init__(self, weights: np.ndarray, newtons: Sequence[float] = (1.0, 0.0, 0.0)):
        self._force = np.outer(weights, newtons)

    def add_force(self, x: np.ndarray, v: np.ndarray, force: np.ndarray) -> None:
        force += self._force


RESIDUAL = "residual force at free nodes / the load"


def residual_error(elements: Elements, load: np.ndarray, held: np.ndarray) -> Callable[[np.ndarray], float]:
    """Return the function from positions (n, 3) [m] to the norm of the residual force over that of ``load`` (n, 3) [N].

    The residual is that of nodes that are not ``held``, computed from ``elements`` and not by the solver under test.
    """

    def error(x: np.ndarray) -> float:
        force = elements.force(x) + load
        force[held] = 0.0
        return float(np.linalg.norm(force) / np.linalg.norm(load))

    return error


def residual_of_weight(system: System, x: np.ndarray) -> float:
    """Return the norm of the residual force at ``x`` (n, 3) [m], over that of the weight of free nodes."""
    return float(np.linalg.norm(system.potential_force(x)) / np.linalg.norm(weight(system)))


def weight(system: System) -> np.ndarray:
    """Return the weights (n, 3) [N] of the nodes, zero where they are held."""
    (_, gravity), *_ = system.offering(Weight)
    return np.outer(np.where(system.free, system.masses, 0.0), gravity.acceleration)


def free_flight(model: str, particles: Particles, v: np.ndarray, tolerance: float) -> Answer:
    """Simulate a free body over 20 steps from its rest shape and velocities ``v`` (n, 3) [m/s], judged by its momentum.

    The error is the larger of two differences from the initial momentum, over Σ ‖m v‖: of the momentum at the end, and
    of the mass times the mean velocity of the centre of mass, from its displacement in 0.2 s.
    """
    x, masses = particles.nodes, particles.masses[:, None]
    flown = np.array(Stepper(model, particles, tolerance=tolerance).advance(x, v, 0.01, 20))
    momentum, scale = (masses * v).sum(axis=0), float(np.linalg.norm(masses * v, axis=1).sum())

    def error(state: np.ndarray) -> float:
        change = (masses * state[1]).sum(axis=0) - momentum
        centre_change = (masses * (state[0] - x)).sum(axis=0) / 0.2 - momentum
        return float(max(np.linalg.norm(change), np.linalg.norm(centre_change)) / scale)

    return Answer(flown, np.array([x, v]), error, zero=np.array([x, 0.0 * v]))


def edge_error(particles: Particles, x: np.ndarray) -> float:
    """Return the largest relative change of length of the tetrahedra's edges at ``x`` (n, 3) [m]."""
    check_finite(x)
    pairs = TetMesh(particles.nodes, particles.tetrahedra).edges
    lengths, rest_lengths = (np.linalg.norm(p[pairs[:, 1]] - p[pairs[:, 0]], axis=1) for p in (x, particles.nodes))
    return float(np.abs(lengths / rest_lengths - 1.0).max())


def end_face(mesh: Mesh) -> np.ndarray:
    """Return the weights (n,), of sum 1, by which a uniform traction on the face of largest x acts on nodes."""
    end_x = mesh.nodes[:, 0].max()
    corners = mesh.triangles[np.isclose(mesh.nodes[mesh.triangles][:, :, 0], end_x).all(axis=1)]
    a, b, c = (mesh.nodes[corners[:, i]] for i in range(3))
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    weights = np.bincount(corners.ravel(), np.repeat(areas, 3), minlength=len(mesh.nodes))
    return weights / weights.sum()


DRIFT_M = np.array([0.1, 0.0, 0.0])
"""Displacement of the centre of a free body in ``recovery``."""
RECOVERY_STEPS = (0.01, 2000), (0.05, 400)
"""Step [s] and number of steps of ``recovery``, of shape matching and of the other models: 20 s."""


def recovery(
    model: str, particles: Particles, x: np.ndarray, more: dict[str, Any] | None = None, measure: Callable | None = None
) -> Answer:
    """Simulate for 20 s how a free body that is deformed to ``x`` (n, 3) [m] recovers its rest shape, while it drifts.

    Its initial velocity is such that its centre moves by DRIFT_M.
    The error is the larger of that of the final shape, by ``measure`` or ``edge_error``, and that of the final centre,
    over the length of DRIFT_M.
    """
    step_s, steps = RECOVERY_STEPS[model not in SHAPES]
    v = np.tile(DRIFT_M / coasting_distance(model, step_s, steps), (len(x), 1))
    recovered, _ = Stepper(model, particles, more).advance(x, v, step_s, steps)
    centre = _centre(particles, x) + DRIFT_M
    shape_error = measure or (lambda a: edge_error(particles, a))

    def error(a: np.ndarray) -> float:
        centre_error = np.linalg.norm(_centre(particles, a) - centre) / np.linalg.norm(DRIFT_M)
        return max(shape_error(a), float(centre_error))

    return Answer(recovered, x, error, zero=particles.nodes)


def coasting_distance(model: str, step_s: float, steps: int) -> float:
    """Return how far [m] a body thrown at 1 m/s moves in ``steps`` steps under the velocity damping of a model."""
    decay = float(np.exp(-MODELS[model][1].get("velocity_damping", {}).get("rate_1_s", 0.0) * step_s))
    return step_s * float(np.sum(decay ** np.arange(steps)))


def _centre(particles: Particles, x: np.ndarray) -> np.ndarray:
    return particles.masses @ x / particles.masses.sum()
