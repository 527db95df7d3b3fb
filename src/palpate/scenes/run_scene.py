"""Run a scene: make the system of its effects, step it, record its motion, and measure the cost of each effect."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from time import perf_counter
from typing import Any, Protocol, cast

import numpy as np
import pandas as pd

from palpate.bodies.particles import Particles
from palpate.effects import effect as hooks
from palpate.effects.effect import Effect
from palpate.errors import InputError, NotConverged
from palpate.scenes import acting_effects, effect_registry, own_effect
from palpate.scenes.motion import Motion, Moved
from palpate.scenes.settings import Scene
from palpate.solvers.system import Integrator, System


def traits(particles: Particles) -> acting_effects.BodyTraits:
    """Return the traits of ``particles`` that decide which effects act."""
    form = "sheet" if particles.thickness_m else "solid" if len(particles.tetrahedra) else "surface"
    return acting_effects.BodyTraits(form, particles.material.law, bool(particles.beds), len(particles.held))


def effect_names(scene: Scene, particles: Particles) -> list[str]:
    """Return the effects that act in their order: the elastic one, then hooks, which contact may stop, then others."""
    names = acting_effects.acting(scene, traits(particles))
    return sorted(names, key=lambda name: 0 if name in effect_registry.ELASTIC else 1 if name == "hooks" else 2)


def decisions(scene: Scene, particles: Particles) -> pd.DataFrame:
    """Return a table with a row for each effect of palpate and of the scene's own: scene, effect, called, reason."""
    rows = [[scene.name, *decision] for decision in acting_effects.decide(scene, traits(particles))]
    return pd.DataFrame(rows, columns=["scene", "effect", "called", "reason"])


def compose(
    scene: Scene, particles: Particles, without: str | None = None, own: Mapping[str, own_effect.Maker] | None = None
) -> System:
    """Return the system of the effects of a scene; no other effect is imported.

    without : name of an effect to leave out; own : more effects, by name
    Raises InputError for an effect that does not suit the particles, and for nodes without mass.
    """
    effects: dict[str, Effect] = {}
    for name in effect_names(scene, particles):
        if name == without:
            continue
        elastic = next(iter(effects.values()), None)
        if name in scene.own:
            effects[name] = own_effect.make(name, scene, particles, elastic)
        else:
            effects[name] = effect_registry.effect(name).make(particles, getattr(scene, name, None), elastic)
    for name, maker in (own or {}).items():
        make_own = partial(maker.make, particles, next(iter(effects.values()), None))
        effects[name] = own_effect.checked(name, make_own, particles)
    if particles.ties is None:
        system = System(particles, effects)
    else:
        from palpate.solvers.tied_system import TiedSystem

        system = TiedSystem(particles, effects)
    if (particles.masses[system.free] <= 0.0).any():
        node = int(np.flatnonzero(system.free & (particles.masses <= 0.0))[0])
        raise InputError(f"{scene.place}: node {node} of {particles.name} has no mass; remove nodes without elements.")
    return system


def initial_positions(particles: Particles, free: np.ndarray, kind: str, seed: int) -> np.ndarray:
    """Return the positions (n, 3) [m] at time zero; nodes that are not ``free``, (n,) bool, are at rest in any case.

    inverted : mirrored at the middle of the first axis
    random : uniform in a cube of the body's size around its middle
    plane, line, point : flattened to the middle along one, two or all axes
    """
    rest = particles.nodes
    middle = rest.mean(axis=0)
    factors = {"plane": [1, 1, 0], "line": [1, 0, 0], "point": [0, 0, 0], "inverted": [-1, 1, 1], "rest": [1, 1, 1]}
    if kind == "random":
        half_size = particles.size / 2
        x = middle + np.random.default_rng(seed).uniform(-half_size, half_size, rest.shape)
    else:
        x = middle + (rest - middle) * factors[kind]
    x[~free] = rest[~free]
    return rest.copy() if kind == "rest" else x


SHARE_OF_LIMIT = 0.9
"""Length of automatic substeps over the longest stable one at rest: a stretched body may need shorter ones."""


class InModes(Integrator, Protocol):
    """A solver whose state is few coordinates, from which positions are computed only on request."""

    def advance(self, h: float) -> None:
        """Make a step of ``h`` [s]; NotConverged if there is none."""

    def state(self) -> tuple[np.ndarray, np.ndarray]:
        """Return positions (n, 3) [m] and velocities [m/s]."""

    def energies(self) -> dict[str, float]:
        """Return its kinetic energy [J] as "kinetic", and the energy [J] of each effect that has one."""

    def contacts(self) -> pd.DataFrame:
        """Return a table of contacts, as the hook ``Contacts`` of effects does."""

    def doubt(self) -> float:
        """Return the solver's own estimate of the error of the last step [m], RMS over the surface."""


@dataclass(frozen=True, eq=False)
class Run:
    """A motion and its cost.

    steps : number of steps; seconds : time of all steps [s]; step_p95_s, step_max_s : 95th percentile and largest time
        of a step [s]
    effect_seconds : time in each effect [s]; effect_kb : memory of each effect [kB]
    doubts_m : own estimate of the error of a motion in modes in each frame but the first [m], empty for other motions
    doubt_s : time of these estimates [s], which is not in ``seconds``
    """

    motion: Motion
    steps: int
    seconds: float
    step_p95_s: float
    step_max_s: float
    effect_seconds: dict[str, float]
    effect_kb: dict[str, float]
    doubts_m: np.ndarray
    doubt_s: float


def run(
    scene: Scene,
    particles: Particles,
    progress: Callable = iter,
    without: str | None = None,
    own: Mapping[str, own_effect.Maker] | None = None,
) -> Run:
    """Simulate a scene of ``particles``, and return its motion and cost.

    progress : wraps the sequence of steps, as ``tqdm`` does
    without : name of an effect to leave out; own : effects besides those of its settings, by name
    Raises InputError for a step beyond the integrator's limit and for objects that overlap at the start; NotConverged,
    naming the time, for a step that is not found or a position that is not finite.
    """
    system = compose(scene, particles, without, own)
    with _naming(f"{scene.place}.integrator is {scene.integrator}"):
        make = partial(effect_registry.integrator(scene.integrator).make, system, scene)
        integrator = make()
    if particles.ties is not None:
        from palpate.solvers.tied_system import TiedSteps, TiedSystem

        assert isinstance(system, TiedSystem)
        integrator = TiedSteps(system, integrator, make)
    substeps = _parts(scene, integrator.limit_s)
    x = initial_positions(particles, system.free, scene.start, scene.seed)
    for _, effect in system.offering(hooks.Placement):
        with _naming(scene.place):
            x = effect.place(x)
    record = _Record(scene, system, system.followed(x), _in_modes(integrator))
    system.seconds = dict.fromkeys(system.effects, 0.0)  # preparation is not part of a step
    loop(system, integrator, scene, record, progress, substeps)
    counted = {id(particles), *map(id, vars(particles).values())}
    kilobytes = {name: _memory(effect, counted) / 1024 for name, effect in system.effects.items()}
    seconds = sum(record.seconds), float(np.percentile(record.seconds, 95)), max(record.seconds)
    doubts = np.array(record.doubts), record.doubt_s
    return Run(record.motion(), scene.steps, *seconds, dict(system.seconds), kilobytes, *doubts)


def _in_modes(integrator: Integrator) -> InModes | None:
    """Return the integrator if its state is few coordinates, else None."""
    return cast(InModes, integrator) if hasattr(integrator, "doubt") else None


def loop(
    system: System, integrator: Integrator, scene: Scene, record: "_Record", progress: Callable, parts: int = 1
) -> None:
    """Step from ``record.x`` to the end of the scene, each step in so many equal ``parts``, and record each.

    Times of steps leave out positions of a motion in modes that only the record needs, and its error estimates.
    """
    x, v, h = record.x, np.zeros_like(record.x), scene.step_s / parts
    modes = _in_modes(integrator)
    for step in progress(range(scene.steps)):
        start = perf_counter()
        for part in range(step * parts, (step + 1) * parts):
            system.at((part + 1) * h)
            try:
                if modes:
                    modes.advance(h)
                else:
                    x, v = integrator.step(x, v, h)
            except NotConverged as failure:
                raise NotConverged(f"{scene.place}, at {part * h:.4g} s: {failure}", failure.history) from failure
            except InputError as error:  # contact checks the positions of bodies when the first step begins
                raise InputError(f"{scene.place}: {error}") from error
            if not modes:
                system.relax(x, h)
        if modes and record.keeps(step + 1):
            x, v = modes.state()
        record.seconds.append(perf_counter() - start)
        if modes:
            x, v = modes.state()
            system.relax(x, h)
        record.after(step + 1, x, v)
        if modes and record.keeps(step + 1):
            start = perf_counter()
            record.doubts.append(modes.doubt())
            record.doubt_s += perf_counter() - start


class _Record:
    """The record of a run: frames, energies, contacts and observed numbers."""

    def __init__(self, scene: Scene, system: System, x: np.ndarray, modes: InModes | None):
        """Begin at ``x`` (n, 3) [m]; a solver in ``modes`` gives energies and contacts itself."""
        self._scene, self._system, self.x, self._modes = scene, system, x, modes
        self._kept_steps = np.unique(
            np.linspace(0, scene.steps, min(scene.frames, scene.steps) + 1).round().astype(int)
        )
        self.seconds: list[float] = []
        self.doubts: list[float] = []  # estimated errors of motions in modes [m], one a frame
        self.doubt_s = 0.0  # time that these estimates took
        # energy and work of the last step [J], and the most that energy has risen in a step beyond the work
        self._last_total, self._last_work, self._gain = np.nan, 0.0, 0.0
        self._frames: list[np.ndarray] = []
        self._rows: list[dict[str, float]] = []
        self._contacts: list[pd.DataFrame] = []
        self._observed: list[dict[str, float]] = []
        self._drawn: list[list[hooks.Shape]] = []
        self._observers = [effect for _, effect in system.offering(hooks.Observation)]
        self._contact_effects = [effect for _, effect in system.offering(hooks.Contacts)]
        self._drawing = [effect for _, effect in system.offering(hooks.Drawn)]
        still = np.zeros_like(x)
        self._keep(0, x, still, self._energies(x, still))

    def keeps(self, step: int) -> bool:
        """Return whether the step of this number ends a frame."""
        return step in self._kept_steps

    def after(self, step: int, x: np.ndarray, v: np.ndarray) -> None:
        """Record the step of this number, which ends at ``x`` (n, 3) [m] with velocities ``v`` [m/s]."""
        effect_seconds = dict(self._system.seconds)
        energies = self._energies(x, v)
        if self._observers:
            row = {"time_s": step * self._scene.step_s}
            for effect in self._observers:
                row |= effect.observe(x)
            self._observed.append(row)
        if self.keeps(step):
            self._keep(step, x, v, energies)
        self._system.seconds.update(effect_seconds)  # recording is not part of an effect's cost

    def _energies(self, x: np.ndarray, v: np.ndarray) -> dict[str, float]:
        """Return all energies [J], their sum, the work, and the most that the sum has risen in a step beyond it."""
        kinetic = 0.5 * float(np.vdot(self._system.masses[:, None] * v, v))
        each = self._modes.energies() if self._modes else {"kinetic": kinetic} | self._system.energies(x)
        work, total = self._system.work_j, sum(each.values())
        self._gain = float(np.fmax(self._gain, total - self._last_total - (work - self._last_work)))
        self._last_work, self._last_total = work, total
        row = {f"{name}_j": energy for name, energy in each.items()}
        return row | {"outer_work_j": work, "total_j": total, "gain_j": self._gain}

    def _keep(self, step: int, x: np.ndarray, v: np.ndarray, energies: dict[str, float]) -> None:
        """Store a frame (positions, energies, contacts, drawings) after a step; NotConverged if it is not finite."""
        time = step * self._scene.step_s
        if not (np.isfinite(x).all() and np.isfinite(v).all()):
            place = f"{self._scene.place}: positions are not finite at {time:.4g} s"
            raise NotConverged(f"{place}; take a shorter step or another integrator.", [])
        self._rows.append({"time_s": time} | energies)
        self._frames.append(x.copy())
        self._drawn.append([shape for effect in self._drawing for shape in effect.drawn(x)])
        if step:  # before the first step there are no contacts yet
            tables = [self._modes.contacts()] if self._modes else [each.contacts(x) for each in self._contact_effects]
            self._contacts += [contacts.assign(time_s=time) for contacts in tables]

    def motion(self) -> Motion:
        """Return the recorded motion; NotConverged if its energy is not finite."""
        energy, particles = pd.DataFrame(self._rows), self._system.particles
        if not np.isfinite(energy["total_j"]).all():
            raise NotConverged(f"{self._scene.place}: its energy is not finite; take a shorter step.", [])
        if self._modes:
            energy["doubt_m"] = [0.0, *self.doubts]
        times = energy["time_s"].to_numpy()
        obstacles = [obstacle for effect in self._contact_effects for obstacle in effect.obstacles]
        return Motion(
            scene=self._scene.name,
            times=times,
            positions=np.array(self._frames),
            rest=particles.nodes,
            triangles=particles.triangles if particles.ties is None else particles.ties.triangles,
            tetrahedra=particles.tetrahedra,
            held=np.flatnonzero(~self._system.free),
            energy=energy,
            obstacles=tuple(
                Moved(o.name, o.kind, o.radius_m, np.array([o.at(time) for time in times]), o.triangles)
                for o in obstacles
            ),
            drawn=tuple(
                Moved(s[0].name, s[0].kind, s[0].radius_m, np.array([shape.points for shape in s]), s[0].triangles)
                for s in zip(*self._drawn, strict=True)
            ),
            observed=pd.DataFrame(self._observed),
            contacts=pd.concat(self._contacts, ignore_index=True) if self._contacts else pd.DataFrame(),
            up=_up(self._system, obstacles),
        )


def _up(system: System, obstacles: Sequence[hooks.Rigid]) -> int:
    """Return the axis of the weight; without weight, the axis normal to a floor; without either, z."""
    for _, effect in system.offering(hooks.Weight):
        if np.any(effect.acceleration):
            return int(np.abs(effect.acceleration).argmax())
    floors = [obstacle.points for obstacle in obstacles if obstacle.kind == "floor"]
    return int(np.ptp(floors[0], axis=0).argmin()) if floors else 2


@contextmanager
def _naming(place: str) -> Iterator[None]:
    """Begin the message of an InputError with ``place``."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{place}: {error}") from error


def _parts(scene: Scene, limit_s: float) -> int:
    """Return the number of substeps of each step; InputError if these are longer than ``limit_s`` [s]."""
    if not isinstance(scene.substeps, int):  # "auto"
        return max(1, math.ceil(scene.step_s / (SHARE_OF_LIMIT * limit_s)))
    if scene.step_s / scene.substeps > limit_s and not scene.allow_unstable:
        words = "" if scene.substeps == 1 else f" in {scene.substeps} substeps"
        raise InputError(
            f"{scene.place}.step_s is {scene.step_s:g} s{words}, and {scene.integrator} takes steps of up "
            f"to {limit_s:.3g} s only; say substeps: auto, take a shorter step, choose backward_euler, or set "
            "allow_unstable: true to see it fail."
        )
    return scene.substeps


def _memory(value: Any, seen: set[int]) -> int:
    """Return the bytes of the arrays in ``value``, without objects in ``seen`` (ids), to which it adds."""
    if id(value) in seen:
        return 0
    seen.add(id(value))
    if isinstance(value, np.ndarray):
        return 0 if value.base is not None and id(value.base) in seen else value.nbytes
    if isinstance(value, dict):
        return sum(_memory(item, seen) for item in list(value.values()))
    if isinstance(value, Sequence) and not isinstance(value, str):
        return sum(_memory(item, seen) for item in value)
    return _memory(vars(value), seen) if hasattr(value, "__dict__") else 0
