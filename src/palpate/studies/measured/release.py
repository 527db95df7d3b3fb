"""The motion after a release, by linear elements and backward Euler in time, and its rows of measured.csv."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from palpate.bodies.body import Body
from palpate.bodies.particles import particles_of
from palpate.effects import effect as hooks
from palpate.effects.elements import locking_is_measured
from palpate.effects.gravity import Gravity
from palpate.effects.held import Held
from palpate.effects.settings import Prony, Stepping
from palpate.errors import InputError, NotConverged
from palpate.scenes.effect_registry import effect, of_law
from palpate.solvers.backward_euler import make
from palpate.solvers.system import System
from palpate.studies.measured.predict import GIVEN, Predictor, Row, compare_swing
from palpate.studies.measured.records import Observed, Oscillation, swing_of, swinging
from palpate.studies.measured.settings import ExperimentSettings, Load, Releases
from palpate.studies.measured.specimen import GRAVITY_M_S2, Bench, FemSpecimen, hung_masses, nodal_loads

TOLERANCE = 1e-6
"""Relative residual of each step."""


CREEP_STEP_S = 0.01
"""Time step of a release with a branch that is fitted to creep."""


@dataclass(frozen=True, eq=False)
class Release:
    """How the motion is computed of a body that is released at once from its shape at rest.

    bench : linear elements on a ``level`` of ``body`` with the markers; softness : how many times softer the body is
    prony : settings of the effect of that name, or None
    """

    body: Body
    level: int
    bench: Bench
    softness: float
    step_s: float
    duration_s: float
    prony: Prony | None = None

    def swing(self, loads: Sequence[Load], gravity: np.ndarray) -> Oscillation:
        """Compute the motion under ``gravity`` (3,) [m/s²] and ``loads``, and fit the markers' mean displacement.

        Raises NotConverged as ``BackwardEuler``, InputError if there is no oscillation.
        """
        system = self._system(loads, gravity)
        integrator = make(system, Stepping(step_s=self.step_s, duration_s=self.duration_s, tolerance=TOLERANCE))
        x = self.bench.specimen.rest.copy()
        v, moves = np.zeros_like(x), [self.bench.moves(x).mean(axis=0)]
        steps = int(np.ceil(self.duration_s / self.step_s))
        for step in range(steps):
            system.at((step + 1) * self.step_s)
            x, v = integrator.step(x, v, self.step_s)
            system.relax(x, self.step_s)
            moves.append(self.bench.moves(x).mean(axis=0))
        along = np.array(moves) @ (moves[-1] / np.linalg.norm(moves[-1]))
        place = f"{self.body.name}: a release in steps of {self.step_s:g} s"
        return swing_of(self.step_s * np.arange(steps + 1), along, place, creeps=self.prony is not None)

    def _system(self, loads: Sequence[Load], gravity: np.ndarray) -> System:
        """Compose elements, masses and loads of the body.

        What hangs on the body adds to the masses of nodes, and so to their weight. A softer body is modelled by larger
        masses and loads, which give the same motion, as its regions would have to be softened one by one.
        """
        particles, mesh = particles_of(self.body, self.level, surface=False), self.body.levels[self.level]
        gravity_m_s2 = float(np.linalg.norm(gravity))
        hung = hung_masses(mesh, loads, gravity_m_s2, order=1).sum(axis=1)
        particles = replace(particles, masses=self.softness * (particles.masses + hung))
        law = particles.material.law
        with locking_is_measured():
            elastic = effect(of_law(law)).make(particles, None, None)
        effects: dict[str, hooks.Effect] = {law: elastic}
        effects |= {"gravity": Gravity(particles, gravity), "held": Held(particles.held)}
        if forces := [load for load in loads if load.force_n is not None]:
            force = nodal_loads(mesh, forces, gravity / gravity_m_s2, order=1)
            effects["load"] = DeadLoad(self.softness * force)
        if self.prony is not None:
            effects["prony"] = effect("prony").make(particles, self.prony, elastic)
        return System(particles, effects)


class DeadLoad(hooks.Load):
    """A constant ``force`` (n, 3) [N] on the nodes."""

    outer = True

    def __init__(self, force: np.ndarray):
        self._force = force

    def add_force(self, x: np.ndarray, v: np.ndarray, force: np.ndarray) -> None:
        force += self._force


def release_rows(
    experiment: ExperimentSettings, observed: Mapping[str, Observed], body: Body, settings: Releases
) -> Iterator[Row]:
    """Yield the rows of releases by linear elements, with each of the time steps, whose modulus is fitted to one case.

    settings : ``measured.models.releases``; with ``creep``, also a release with one Prony branch, fitted to that case.
    A release that fails has rows with a message.
    """
    level, steps, creep = settings.level, settings.steps_s, settings.creep
    fitted, material, crept = experiment.calibrate_on, body.material, None
    if creep is not None and fitted is not None and observed[fitted].creep_m > 0.0:
        crept = observed[fitted]
    if not (steps or crept):
        return
    predictor = Predictor(experiment, dict(observed), FemSpecimen(body, level, 1))
    about: Row = {"model": "fem_p1", "nodes": len(predictor.specimen.rest), "young_pa": material.young_pa}
    about |= {"poisson": material.poisson, "law": material.law, "calibrated": GIVEN if fitted is None else fitted}
    try:
        softness = 1.0 if fitted is None else predictor.softness(fitted)
    except NotConverged as failure:
        yield about | {"setting": f"level={level}", "softness": 1.0, "message": str(failure)}
        return
    about |= {"softness": softness}
    for step_s in steps:
        release = Release(body, level, predictor.bench, softness, step_s, settings.duration_s)
        yield from _rows(release, predictor, about | {"setting": f"level={level} step_s={step_s:g}"})
    if crept and creep:
        prony = _fitted_branch(crept, material.poisson)
        release = Release(body, level, predictor.bench, softness, CREEP_STEP_S, creep.duration_s, prony)
        about |= {"setting": f"level={level} prony step_s={CREEP_STEP_S:g}"}
        yield from _rows(release, predictor, about)


def _rows(release: Release, predictor: Predictor, about: Row) -> Iterator[Row]:
    """Yield the rows of one release: frequency and damping, or with the Prony effect creep, of each case."""
    names = ("frequency_hz", "damping_ratio") if release.prony is None else ("creep_m", "creep_s")
    experiment = predictor.experiment
    for case in swinging(experiment):
        predicted, message, seen = dict.fromkeys(names), "", predictor.observed[case]
        try:
            swing = release.swing(experiment.cases[case].loads, GRAVITY_M_S2 * seen.down)
            predicted = {name: getattr(swing, name) for name in names}
        except (NotConverged, InputError) as failure:
            message = str(failure)
        fitted = names if release.prony is not None and case == experiment.calibrate_on else ()
        yield from compare_swing(seen, predicted, about | {"case": case, "message": message}, fitted)


def _fitted_branch(seen: Observed, poisson: float) -> Prony:
    """Return the Prony branch of relative modulus g and time τ with which a beam creeps as it was observed to.

    In bending and tension the modulus falls by the fraction c = 2 (1 + ν) g / 3, as the bulk modulus stays, and under a
    constant load c of the whole displacement creeps with the time constant τ / (1 − g).
    """
    g = 3.0 * seen.creep_m / seen.sink_m / (2.0 * (1.0 + poisson))
    creep_s = float(np.mean([swing.creep_s for swing in seen.swings]))
    return Prony(shares=[g], times_s=[creep_s * (1.0 - g)])
