"""A hard case and the judgement of its outcomes; small bodies, and the models and runs that cases share."""

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from palpate.bodies.body import Body, nest
from palpate.bodies.material import Material
from palpate.bodies.mesh import Mesh, TetMesh
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
"""Wrong answers that the bound of a case must fail, as in ``Answer``."""
NEARLY = "twentieth"
"""The wrong answer that bounds fail, too, except those of models that are ``blunt``."""
SHARES = {"tenth": 0.1, NEARLY: 0.05}
"""Shares of the way from an answer's origin by which two wrong answers go too far, or not far enough."""
UNMEASURABLE = 1e9
"""Number at which the error of a wrong answer is cut, and that of one that cannot be measured at all."""


@dataclass(frozen=True, eq=False)
class Answer:
    """The answer of a model in a case, and the measure of its error, which can be taken of any other answer, too.

    found : the answer, an array of any shape; frozen : that of a solver which returns what it was given; zero : that of
        no displacement, by default the same; both of a shape that fits ``found``
    error : computes the number that the case bounds
    origin : from which SHARES more and less are reckoned, by default ``frozen``
    """

    found: np.ndarray
    frozen: np.ndarray
    error: Callable[[np.ndarray], float]
    zero: np.ndarray | None = None
    origin: np.ndarray | None = None

    def wrong(self) -> dict[str, float]:
        """Return the errors of the answers WRONG and NEARLY: of a share too much and too little, the smaller error."""
        way = self.found - (self.frozen if self.origin is None else self.origin)
        made = {"frozen": [self.frozen], "zero": [self.frozen if self.zero is None else self.zero]}
        made |= {name: [self.found - share * way, self.found + share * way] for name, share in SHARES.items()}
        shape = self.found.shape
        return {name: min(self._error(np.broadcast_to(one, shape)) for one in some) for name, some in made.items()}

    def _error(self, answer: np.ndarray) -> float:
        """Return the error of a wrong answer, UNMEASURABLE if it cannot be measured."""
        try:
            with np.errstate(all="ignore"):
                value = float(self.error(answer))
        except (ArithmeticError, InputError, NotConverged):
            return UNMEASURABLE
        return min(value, UNMEASURABLE) if math.isfinite(value) else UNMEASURABLE


@dataclass(frozen=True, eq=False)
class Case:
    """One situation in which numerics may fail, with the result that was expected beforehand.

    scene : the situation; expected : the behaviour of a good model; source : author of the idea; all in words
    measure : meaning of the error of the answer that ``run`` returns for each of ``models``; it must not exceed
        ``bound``, and the errors of WRONG answers must
    declared : acceptable outcomes by model; ``stable`` for models that are not named
    bounds : tighter bounds by model
    blunt : models whose own error lets no bound fail NEARLY
    """

    name: str
    scene: str
    expected: str
    measure: str
    bound: float
    run: Callable[[str], Answer]
    models: Collection[str]
    declared: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    source: str = "palpate"
    bounds: Mapping[str, float] = field(default_factory=dict)
    blunt: Collection[str] = ()

    def acceptable(self, model: str) -> tuple[str, ...]:
        """Return the outcomes declared for a model."""
        return self.declared.get(model, ("stable",))


def finite(*arrays: np.ndarray) -> None:
    """Raise FloatingPointError, which is judged ``nan``, if a value is not finite."""
    for array in arrays:
        if not np.isfinite(array).all():
            raise FloatingPointError("a value that was returned is not finite")


def judge(case: Case, model: str) -> dict:
    """Return the row of one model in one case: the outcome, and whether it was declared.

    Every exception except InputError and NotConverged is judged ``wrong``, since a crash does not count as a refusal;
    FloatingPointError is judged ``nan``. ``message`` : the text of the exception; ``frozen``, ``zero``, ``tenth`` and
    ``twentieth`` : the errors of these answers, empty without one; ``sharp`` : whether those of WRONG are beyond the
    bound, empty unless stable
    """
    value, message, wrong = math.nan, "", dict.fromkeys((*WRONG, NEARLY), math.nan)
    bound = case.bounds.get(model, case.bound)
    try:
        answer = case.run(model)
        finite(answer.found)
        value = float(answer.error(answer.found))
        wrong = answer.wrong()
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
    sharp = all(wrong[name] > bound for name in WRONG) if outcome == "stable" else None
    return {
        "case": case.name,
        "source": case.source,
        "scene": case.scene,
        "model": model,
        "outcome": outcome,
        "measure": case.measure,
        "value": value,
        "bound": bound,
        **wrong,
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
"""Name of an integrator, and the blocks of a scene."""


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
"""Integrator and blocks of each model."""


def bar_mesh(degrees: float = 0.0) -> TetMesh:
    """Make a bar of 0.2 m × 0.05 m × 0.05 m in 192 tetrahedra; if given, with a layer more of so small angles."""
    places = np.linspace(0.0, 0.2, 9)
    if degrees:
        places = np.insert(places, 4, 0.075 + 0.025 * np.tan(np.radians(degrees)))
    mesh = box([len(places) - 1.0, 0.05, 0.05], [len(places) - 1, 2, 2])
    along = np.interp(mesh.nodes[:, 0], np.arange(len(places)), places)
    return TetMesh(np.column_stack([along, mesh.nodes[:, 1:]]), mesh.tetrahedra)


def bar_body(refined: int, material: Material = SOFT, degrees: float = 0.0, held: bool = True) -> Body:
    """Make ``bar_mesh`` a body that is ``refined`` so many times, with its end at x = 0 ``held`` or free."""
    mesh = bar_mesh(degrees)
    return nest("bar", mesh, refined, _end(mesh) if held else _end(mesh)[:0], material)


def bar(held: bool = True, material: Material = SOFT, degrees: float = 0.0) -> Particles:
    """Make ``bar_mesh`` particles, with its end at x = 0 ``held`` or free."""
    mesh = bar_mesh(degrees)
    return solid_particles(mesh, _end(mesh) if held else _end(mesh)[:0], material, "bar")


def _end(mesh: TetMesh) -> np.ndarray:
    return np.flatnonzero(mesh.nodes[:, 0] == 0.0)


def points(name: str, nodes: np.ndarray, held: Sequence[int] = ()) -> Particles:
    """Make particles of 1 kg at ``nodes`` (n, 3) [m], without a surface and without elements."""
    none = np.empty((0, 3), dtype=int), np.empty((0, 4), dtype=int)
    return Particles(name, nodes, np.ones(len(nodes)), np.array(held, dtype=int), *none, SOFT)


def scene(model: str, step_s: float, duration_s: float, more: dict[str, Any] | None = None, **rest: Any) -> Scene:
    """Make a scene of one of MODELS, with ``more`` blocks; nothing holds the body unless these say so."""
    integrator, blocks = MODELS[model]
    stepping = {"integrator": integrator, "step_s": step_s, "duration_s": duration_s}
    named = {"name": "hard_case", "body": "body", "held": False}
    return Scene.model_validate(named | stepping | blocks | (more or {}) | rest)


def one_cluster(model: str) -> dict[str, Any]:
    """Return the block of one of SHAPES, with one cluster instead of several."""
    return {"shape_matching": MODELS[model][1]["shape_matching"] | {"clusters": {"kind": "one"}}}


class Stepper:
    """Time steps of one of MODELS, with ``more`` effects, from any state."""

    def __init__(self, model: str, particles: Particles, more: dict[str, Any] | None = None, tolerance: float = 1e-8):
        self._scene = scene(model, 1.0, 1.0, more, tolerance=tolerance)
        self.system = compose(self._scene, particles)
        self.integrator = effect_registry.integrator(self._scene.integrator).make(self.system, self._scene)

    def go(self, x: np.ndarray, v: np.ndarray, step_s: float, steps: int) -> tuple[np.ndarray, np.ndarray]:
        """Compute positions (n, 3) [m] and velocities [m/s] after some steps.

        ``gained`` [J] becomes the largest excess of the energy over its value at the start and the work of loads
        since, for models with an energy.
        """
        counts = self.system.effects.keys().isdisjoint({"shape_matching"})
        first = self.total(x, v) - self.system.work_j if counts else 0.0
        self.gained = 0.0
        for number in range(steps):
            self.system.at((number + 1) * step_s)
            x, v = self.integrator.step(x, v, step_s)
            finite(x, v)
            self.system.relax(x, step_s)
            if counts:
                self.gained = max(self.gained, self.total(x, v) - self.system.work_j - first)
        return x, v

    def total(self, x: np.ndarray, v: np.ndarray) -> float:
        """Return the sum of kinetic and potential energy [J]."""
        return 0.5 * float(np.vdot(self.system.masses[:, None] * v, v)) + self.system.energy(x)


class Pull:
    """A force of 1 N along x, or ``newtons`` (3,), distributed over nodes by ``shares`` (n,)."""

    outer = True

    def __init__(self, shares: np.ndarray, newtons: Sequence[float] = (1.0, 0.0, 0.0)):
        self._force = np.outer(shares, newtons)

    def add_force(self, x: np.ndarray, v: np.ndarray, force: np.ndarray) -> None:
        force += self._force


RESIDUAL = "residual force at free nodes / the load"


def residual(elements: Elements, load: np.ndarray, held: np.ndarray) -> Callable[[np.ndarray], float]:
    """Measure positions (n, 3) [m] by the residual force at nodes that are not ``held``, relative to ``load`` [N].

    It is computed apart from the solver that found them.
    """

    def error(x: np.ndarray) -> float:
        force = elements.force(x) + load
        force[held] = 0.0
        return float(np.linalg.norm(force) / np.linalg.norm(load))

    return error


def unbalanced(system: System, x: np.ndarray) -> float:
    """Return the residual of the equilibrium at ``x`` (n, 3) [m], relative to the weight of free nodes."""
    return float(np.linalg.norm(system.potential_force(x)) / np.linalg.norm(weight(system)))


def weight(system: System) -> np.ndarray:
    """Return the weights (n, 3) [N] of the nodes, zero where they are held."""
    (_, gravity), *_ = system.offering(Weight)
    return np.outer(np.where(system.free, system.masses, 0.0), gravity.acceleration)


def keeps_momentum(model: str, particles: Particles, v: np.ndarray, tolerance: float) -> Answer:
    """Step a free body 20 times from rest and velocities ``v`` (n, 3) [m/s].

    The error is the larger of the change of momentum and of the deviation of the centre of mass from uniform motion,
    times mass and over time, relative to the sum of the nodes' momenta at the start.
    """
    x, masses = particles.nodes, particles.masses[:, None]
    found = np.array(Stepper(model, particles, tolerance=tolerance).go(x, v, 0.01, 20))
    momentum, scale = (masses * v).sum(axis=0), float(np.linalg.norm(masses * v, axis=1).sum())

    def error(state: np.ndarray) -> float:
        change = (masses * state[1]).sum(axis=0) - momentum
        strayed = (masses * (state[0] - x)).sum(axis=0) / 0.2 - momentum
        return float(max(np.linalg.norm(change), np.linalg.norm(strayed)) / scale)

    return Answer(found, np.array([x, v]), error, zero=np.array([x, 0.0 * v]))


def edge_error(particles: Particles, x: np.ndarray) -> float:
    """Return the largest relative change of length of the tetrahedra's edges at ``x`` (n, 3) [m]."""
    finite(x)
    pairs = TetMesh(particles.nodes, particles.tetrahedra).edges
    now, rest = (np.linalg.norm(p[pairs[:, 1]] - p[pairs[:, 0]], axis=1) for p in (x, particles.nodes))
    return float(np.abs(now / rest - 1.0).max())


def end_face(mesh: Mesh) -> np.ndarray:
    """Return each node's share, (n,), of a uniform traction on the face of largest x."""
    end = mesh.nodes[:, 0].max()
    corners = mesh.triangles[np.isclose(mesh.nodes[mesh.triangles][:, :, 0], end).all(axis=1)]
    a, b, c = (mesh.nodes[corners[:, i]] for i in range(3))
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    shares = np.bincount(corners.ravel(), np.repeat(areas, 3), minlength=len(mesh.nodes))
    return shares / shares.sum()


TRAVEL_M = np.array([0.1, 0.0, 0.0])
"""Distance over which a free body drifts."""
RETURN_STEPS = (0.01, 2000), (0.05, 400)
"""Step [s] and number of steps of shape matching and of the other models: 20 s."""


def returns(
    model: str, particles: Particles, x: np.ndarray, more: dict[str, Any] | None = None, measure: Callable | None = None
) -> Answer:
    """Simulate a free body from ``x`` (n, 3) [m] for 20 s, with a drift over TRAVEL_M.

    The error is the larger one of ``measure`` at the end, by default that of the edges, and of the centre's place,
    relative to the way that it had to go.
    """
    step_s, steps = RETURN_STEPS[model not in SHAPES]
    travel = travel_s(model, step_s, steps)
    found, _ = Stepper(model, particles, more).go(x, np.tile(TRAVEL_M / travel, (len(x), 1)), step_s, steps)
    centre = _centre(particles, x) + TRAVEL_M
    shape = measure or (lambda a: edge_error(particles, a))

    def error(a: np.ndarray) -> float:
        strayed = np.linalg.norm(_centre(particles, a) - centre) / np.linalg.norm(TRAVEL_M)
        return max(shape(a), float(strayed))

    return Answer(found, x, error, zero=particles.nodes)


def travel_s(model: str, step_s: float, steps: int) -> float:
    """Return the way [m] of a body that is thrown at 1 m/s, under the model's damping of velocities."""
    decay = float(np.exp(-MODELS[model][1].get("velocity_damping", {}).get("rate_1_s", 0.0) * step_s))
    return step_s * float(np.sum(decay ** np.arange(steps)))


def _centre(particles: Particles, x: np.ndarray) -> np.ndarray:
    return particles.masses @ x / particles.masses.sum()
