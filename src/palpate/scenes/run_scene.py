"""Run a scene: the system of exactly the effects that it names, its steps and records, and the cost of each effect."""

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


def moved(particles: Particles) -> acting_effects.Moved:
    """Return what decides on effects of ``particles``."""
    form = "sheet" if particles.thickness_m else "solid" if len(particles.tetrahedra) else "surface"
    return acting_effects.Moved(form, particles.material.law, bool(particles.beds), len(particles.held))


def effect_names(scene: Scene, particles: Particles) -> list[str]:
    """Return the effects that act, the elastic one first, and hooks before contact can stop them."""
    names = acting_effects.acting(scene, moved(particles))
    return sorted(names, key=lambda name: 0 if name in effect_registry.ELASTIC else 1 if name == "hooks" else 2)


def decisions(scene: Scene, particles: Particles) -> pd.DataFrame:
    """Tabulate one row for each effect there is: scene, effect, called, reason."""
    rows = [[scene.name, *decision] for decision in acting_effects.decide(scene, moved(particles))]
    return pd.DataFrame(rows, columns=["scene", "effect", "called", "reason"])


def compose(
    scene: Scene, particles: Particles, without: str | None = None, own: Mapping[str, own_effect.Maker] | None = None
) -> System:
    """Import and make the effects of a scene, and no others; ``without`` names one to leave out, ``own`` more of them.

    Raises InputError for one that does not suit the particles, and for nodes without mass.
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
        made = partial(maker.make, particles, next(iter(effects.values()), None))
        effects[name] = own_effect.checked(name, made, particles)
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
    flat = {"plane": [1, 1, 0], "line": [1, 0, 0], "point": [0, 0, 0], "inverted": [-1, 1, 1], "rest": [1, 1, 1]}
    if kind == "random":
        half = particles.size / 2
        x = middle + np.random.default_rng(seed).uniform(-half, half, rest.shape)
    else:
        x = middle + (rest - middle) * flat[kind]
    x[~free] = rest[~free]
    return rest.copy() if kind == "rest" else x


SHARE_OF_LIMIT = 0.9
"""Length of a substep that is chosen, in longest stable ones at rest: a stretched body may need shorter ones."""


class InModes(Integrator, Protocol):
    """A solver that keeps few coordinates, of which positions are made where somebody asks for them."""

    def advance(self, h: float) -> None:
        """Make a step of ``h`` [s]; NotConverged if there is none."""

    def state(self) -> tuple[np.ndarray, np.ndarray]:
        """Return positions (n, 3) [m] and velocities [m/s]."""

    def energies(self) -> dict[str, float]:
        """Return its kinetic energy [J] as "kinetic", and the energy [J] of each effect that has one."""

    def contacts(self) -> pd.DataFrame:
        """Return one row for each contact, as the effect contact does of positions."""

    def doubt(self) -> float:
        """Return what grows with the error of the last step [m], RMS over the surface."""


@dataclass(frozen=True, eq=False)
class Run:
    """A motion and its cost.

    steps : number of steps; seconds : time of the whole loop [s]; step_p95_s, step_max_s : 95 % of the steps, and all
        of them, took at most this [s]
    effect_seconds : time in each effect [s]; effect_kb : memory that each effect holds [kB]
    doubts_m : what a motion in modes says of its own error in each frame but the first [m], empty of others; doubt_s :
        the time of all these [s], which is not in ``seconds``
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
    """Simulate a scene; ``without`` names an effect to leave out, ``own`` are effects beside its blocks.

    ``progress`` wraps the sequence of steps, as ``tqdm`` does. Raises InputError for a step beyond the integrator's
    known limit and for objects that overlap at the start; NotConverged, naming the time, for a step that is not found
    or a position that is not finite.
    """
    system = compose(scene, particles, without, own)
    with _told(f"{scene.place}.integrator is {scene.integrator}"):
        make = partial(effect_registry.integrator(scene.integrator).make, system, scene)
        integrator = make()
    if particles.ties is not None:
        from palpate.solvers.tied_system import TiedSteps, TiedSystem

        assert isinstance(system, TiedSystem)
        integrator = TiedSteps(system, integrator, make)
    parts = _parts(scene, integrator.limit_s)
    x = initial_positions(particles, system.free, scene.start, scene.seed)
    for _, effect in system.offering(hooks.Placement):
        with _told(scene.place):
            x = effect.place(x)
    record = _Record(scene, system, system.followed(x), _in_modes(integrator))
    system.seconds = dict.fromkeys(system.effects, 0.0)  # preparation is not part of a step
    loop(system, integrator, scene, record, progress, parts)
    seen = {id(particles), *map(id, vars(particles).values())}
    kilobytes = {name: _memory(effect, seen) / 1024 for name, effect in system.effects.items()}
    seconds = sum(record.seconds), float(np.percentile(record.seconds, 95)), max(record.seconds)
    doubts = np.array(record.doubts), record.doubt_s
    return Run(record.motion(), scene.steps, *seconds, dict(system.seconds), kilobytes, *doubts)


def _in_modes(integrator: Integrator) -> InModes | None:
    """Return the integrator if it keeps few coordinates."""
    return cast(InModes, integrator) if hasattr(integrator, "doubt") else None


def loop(
    system: System, integrator: Integrator, scene: Scene, record: "_Record", progress: Callable, parts: int = 1
) -> None:
    """Step from ``record.x`` to the end of the scene, each step in so many equal ``parts``.

    Positions that are made of modes for the sake of the record alone are not part of a step, as little as their doubt.
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
    """Frames, energies, contacts and work during a run."""

    def __init__(self, scene: Scene, system: System, x: np.ndarray, modes: InModes | None):
        """Begin at ``x`` (n, 3) [m]; energies and contacts of ``modes`` are not those of effects at nodes."""
        self._scene, self._system, self.x, self._modes = scene, system, x, modes
        self._every = np.unique(np.linspace(0, scene.steps, min(scene.frames, scene.steps) + 1).round().astype(int))
        self.seconds: list[float] = []
        self.doubts: list[float] = []
        self.doubt_s = 0.0
        self._total, self._worked, self._gain = np.nan, 0.0, 0.0
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
        return step in self._every

    def after(self, step: int, x: np.ndarray, v: np.ndarray) -> None:
        spent = dict(self._system.seconds)
        energies = self._energies(x, v)
        if self._observers:
            row = {"time_s": step * self._scene.step_s}
            for effect in self._observers:
                row |= effect.observe(x)
            self._observed.append(row)
        if self.keeps(step):
            self._keep(step, x, v, energies)
        self._system.seconds.update(spent)  # recording is not part of an effect's cost

    def _energies(self, x: np.ndarray, v: np.ndarray) -> dict[str, float]:
        """Return all energies [J] and their sum, and keep the most that a step has gained beyond the work."""
        kinetic = 0.5 * float(np.vdot(self._system.masses[:, None] * v, v))
        each = self._modes.energies() if self._modes else {"kinetic": kinetic} | self._system.energies(x)
        work, total = self._system.work_j, sum(each.values())
        self._gain = float(np.fmax(self._gain, total - self._total - (work - self._worked)))
        self._worked, self._total = work, total
        found = {f"{name}_j": energy for name, energy in each.items()}
        return found | {"outer_work_j": work, "total_j": total, "gain_j": self._gain}

    def _keep(self, step: int, x: np.ndarray, v: np.ndarray, energies: dict[str, float]) -> None:
        time = step * self._scene.step_s
        if not (np.isfinite(x).all() and np.isfinite(v).all()):
            place = f"{self._scene.place}: positions are not finite at {time:.4g} s"
            raise NotConverged(f"{place}; take a shorter step or another integrator.", [])
        self._rows.append({"time_s": time} | energies)
        self._frames.append(x.copy())
        self._drawn.append([shape for effect in self._drawing for shape in effect.drawn(x)])
        if step:  # before the first step there are no contacts yet
            found = [self._modes.contacts()] if self._modes else [each.contacts(x) for each in self._contact_effects]
            self._contacts += [contacts.assign(time_s=time) for contacts in found]

    def motion(self) -> Motion:
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
                Moved(s[0].name, s[0].kind, s[0].radius_m, np.array([each.points for each in s]), s[0].triangles)
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
def _told(place: str) -> Iterator[None]:
    """Begin the message of an InputError with ``place``."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{place}: {error}") from error


def _parts(scene: Scene, limit_s: float) -> int:
    """Return in how many parts each step is taken; InputError if these are longer than ``limit_s`` [s]."""
    if not isinstance(scene.substeps, int):  # "auto"
        return max(1, math.ceil(scene.step_s / (SHARE_OF_LIMIT * limit_s)))
    if scene.step_s / scene.substeps > limit_s and not scene.allow_unstable:
        parts = "" if scene.substeps == 1 else f" in {scene.substeps} substeps"
        raise InputError(
            f"{scene.place}.step_s is {scene.step_s:g} s{parts}, and {scene.integrator} takes steps of up "
            f"to {limit_s:.3g} s only; say substeps: auto, take a shorter step, choose backward_euler, or set "
            "allow_unstable: true to see it fail."
        )
    return scene.substeps


def _memory(value: Any, seen: set[int]) -> int:
    """Return the bytes of the arrays in ``value``, each array once and without those in ``seen``, which grows."""
    if id(value) in seen:
        return 0
    seen.add(id(value))
    if isinstance(value, np.ndarray):
        return 0 if value.base is not None and id(value.base) in seen else value.nbytes
    if isinstance(value, dict):
        return sum(_memory(inner, seen) for inner in list(value.values()))
    if isinstance(value, Sequence) and not isinstance(value, str):
        return sum(_memory(inner, seen) for inner in value)
    return _memory(vars(value), seen) if hasattr(value, "__dict__") else 0
