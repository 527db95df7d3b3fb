"""Run a scene: the loop, what it records, and what each effect costs."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import perf_counter

import numpy as np
import pandas as pd

from palpate.bodies.particles import Particles
from palpate.errors import InputError, NotConverged
from palpate.scenes import effect_registry
from palpate.scenes.compose import compose
from palpate.scenes.initial_states import start_of
from palpate.scenes.motion import Motion, Moved
from palpate.scenes.scene import Scene
from palpate.solvers.system import System


@dataclass(frozen=True, eq=False)
class Run:
    """A motion and its cost: steps taken, seconds of the whole loop and in each effect, memory each effect holds.

    step_p95_s : what 95 % of the steps take at most [s]
    """

    motion: Motion
    steps: int
    seconds: float
    step_p95_s: float
    effect_seconds: dict[str, float]
    effect_kb: dict[str, float]


def run(scene: Scene, particles: Particles, progress: Callable = iter, without: str | None = None) -> Run:
    """Simulate a scene, or with ``without`` what it would be if that effect were left out.

    ``progress`` wraps the sequence of steps, as ``tqdm`` does. Raises InputError for a step beyond the
    integrator's known limit and for a scene that begins with things that overlap, NotConverged naming the time at
    which a step was not found or a position was not finite.
    """
    system = compose(scene, particles, without)
    integrator = _integrator(scene, system)
    _check_step(scene, integrator.limit_s)
    record = _Record(scene, system, start_of(particles, system.free, scene.start, scene.seed))
    system.seconds = dict.fromkeys(system.effects, 0.0)  # preparing is not part of a step
    loop(system, integrator, scene, record, progress)
    seen = {id(particles), *map(id, vars(particles).values())}
    kilobytes = {name: _memory(effect, seen) / 1024 for name, effect in system.effects.items()}
    seconds = sum(record.seconds), float(np.percentile(record.seconds, 95))
    return Run(record.motion(), scene.steps, *seconds, dict(system.seconds), kilobytes)


def loop(system: System, integrator, scene: Scene, record: "_Record", progress: Callable) -> None:
    """Step from ``record.x`` to the end of the scene."""
    x, v, h = record.x, np.zeros_like(record.x), scene.step_s
    for step in progress(range(scene.steps)):
        start = perf_counter()
        system.at((step + 1) * h)
        try:
            moved, v = integrator.step(x, v, h)
        except NotConverged as failure:
            raise NotConverged(f"{scene.place}, at {step * h:.4g} s: {failure}", failure.history) from failure
        except InputError as error:  # contact looks at where bodies are when the first step begins
            raise InputError(f"{scene.place}: {error}") from error
        system.relax(moved, h)
        record.seconds.append(perf_counter() - start)
        record.after(step + 1, x, moved, v)
        x = moved


class _Record:
    """Frames, energies and work along the way."""

    def __init__(self, scene: Scene, system: System, x: np.ndarray):
        self._scene, self._system, self.x = scene, system, x
        self._every = np.unique(np.linspace(0, scene.steps, min(scene.frames, scene.steps) + 1).round().astype(int))
        self.seconds: list[float] = []
        self._work = 0.0
        self._frames, self._rows, self._contacts, self._observed = [], [], [], []
        self._observers = [effect for _, effect in system.offering("observe")]
        self._touchers = [effect for _, effect in system.offering("contacts")]
        self._loaded = bool([e for e in system.effects.values() if getattr(e, "outer", False)])
        self._keep(0, x, np.zeros_like(x))

    def after(self, step: int, before: np.ndarray, x: np.ndarray, v: np.ndarray) -> None:
        """Take note of one step."""
        spent = dict(self._system.seconds)
        if self._loaded:
            self._work += float(np.vdot(self._system.outer_force(before, v), x - before))
        if self._observers:
            seen = {"time_s": step * self._scene.step_s}
            for effect in self._observers:
                seen |= effect.observe(x)
            self._observed.append(seen)
        if step == self._every[len(self._frames)]:
            self._keep(step, x, v)
        self._system.seconds.update(spent)  # taking notes is not part of what an effect costs

    def _keep(self, step, x, v) -> None:
        if not (np.isfinite(x).all() and np.isfinite(v).all()):
            raise NotConverged(
                f"{self._scene.place}: positions are not finite at {step * self._scene.step_s:.4g} s; "
                "take a shorter step or another integrator.",
                [],
            )
        potentials = self._system.energies(x)
        kinetic = 0.5 * float(np.vdot(self._system.masses[:, None] * v, v))
        row = {"time_s": step * self._scene.step_s, "kinetic_j": kinetic}
        row |= {f"{name}_j": energy for name, energy in potentials.items()}
        self._rows.append(row | {"outer_work_j": self._work, "total_j": kinetic + sum(potentials.values())})
        self._frames.append(x.copy())
        if step:  # nothing touches before the first step
            self._contacts += [effect.contacts(x).assign(time_s=row["time_s"]) for effect in self._touchers]

    def motion(self) -> Motion:
        """What was recorded."""
        energy = pd.DataFrame(self._rows)
        particles = self._system.particles
        held = np.flatnonzero(~self._system.free)
        times, positions = energy["time_s"].to_numpy(), np.array(self._frames)
        cells = particles.triangles, particles.tetrahedra
        contacts = pd.concat(self._contacts, ignore_index=True) if self._contacts else pd.DataFrame()
        things = [thing for effect in self._touchers for thing in effect.obstacles]
        moved = tuple(
            Moved(t.name, t.kind, t.radius_m, np.array([t.at(time) for time in times]), t.triangles) for t in things
        )
        tables, up = (pd.DataFrame(self._observed), contacts), _up(self._system, things)
        return Motion(self._scene.name, times, positions, particles.nodes, *cells, held, energy, moved, *tables, up)


def _up(system: System, things: list) -> int:
    """The axis along which weight pulls, or else a floor's, or else z."""
    if "gravity" in system.effects and system.effects["gravity"].acceleration.any():
        return int(np.abs(system.effects["gravity"].acceleration).argmax())
    floors = [thing.points for thing in things if thing.kind == "floor"]
    return int(np.ptp(floors[0], axis=0).argmin()) if floors else 2


def _integrator(scene: Scene, system: System):
    try:
        return effect_registry.integrator(scene.integrator).make(system, {"tolerance": scene.tolerance})
    except InputError as error:
        raise InputError(f"{scene.place}.integrator is {scene.integrator}: {error}") from error


def _check_step(scene: Scene, limit_s: float) -> None:
    if scene.step_s > limit_s and not scene.allow_unstable:
        raise InputError(
            f"{scene.place}.step_s is {scene.step_s:g} s, and {scene.integrator} is stable up to {limit_s:.3g} s only; "
            "take a shorter step, choose backward_euler, or set allow_unstable: true to see it fail."
        )


def _memory(value: object, seen: set[int]) -> int:
    """Bytes of the arrays that an effect holds, each counted once and the particles' own not."""
    if id(value) in seen:
        return 0
    seen.add(id(value))
    if isinstance(value, np.ndarray):
        return 0 if value.base is not None and id(value.base) in seen else value.nbytes
    if isinstance(value, dict):
        return sum(_memory(inner, seen) for inner in value.values())
    if isinstance(value, Sequence) and not isinstance(value, str):
        return sum(_memory(inner, seen) for inner in value)
    return _memory(vars(value), seen) if hasattr(value, "__dict__") else 0
