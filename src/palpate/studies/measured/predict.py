"""Predict every case of an experiment with one model, with E as given and fitted to one case, and compare."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from scipy import sparse

from palpate.errors import NotConverged
from palpate.linalg.multigrid import conjugate_gradients
from palpate.studies.measured.experiment import GIVEN, Case, Experiment
from palpate.studies.measured.records import Observed
from palpate.studies.measured.specimen import Bench, Specimen

ALL = "all"
"""The name of the mean over markers."""
Row = dict[str, Any]


def compare_moves(experiment: Experiment, seen: Observed, moves: np.ndarray | None) -> Iterator[Row]:
    """Yield how far markers sink, each and on average, and how far they move as vectors (RMS over markers).

    moves : (m, 3) [m] as predicted, or None if there is no prediction. Of vectors the error is that of their
    difference, and cannot be negative.
    """
    names, found = [marker.name for marker in experiment.compared], [repeat.moves for repeat in seen.repeats]
    sinks = [each @ seen.axis for each in found]
    sunk = None if moves is None else moves @ seen.axis
    yield _row("sink_m", ALL, [float(s.mean()) for s in sinks], None if sunk is None else float(sunk.mean()))
    for i, name in enumerate(names):
        yield _row("sink_m", name, [float(s[i]) for s in sinks], None if sunk is None else float(sunk[i]))
    measured = None if seen.moves is None else _rms(seen.moves)
    repeat = max((_rms(a - b) for a, b in combinations(found, 2)), default=None)
    wrong = None if measured is None or moves is None else _rms(moves - seen.moves) / measured
    predicted = None if moves is None else _rms(moves)
    yield dict(quantity="move_m", marker=ALL, measured=measured, repeat=repeat, predicted=predicted, error=wrong)


def compare_swing(seen: Observed, swing: dict[str, float | None]) -> Iterator[Row]:
    """Yield rows of the quantities of an Oscillation that ``swing`` predicts, by their names; None if it failed."""
    for quantity, predicted in swing.items():
        yield _row(quantity, ALL, [float(getattr(each, quantity)) for each in seen.swings], predicted)


def _row(quantity: str, marker: str, repeats: list[float], predicted: float | None) -> Row:
    """Return the mean of ``repeats``, the widest difference between two, and the relative error of ``predicted``."""
    measured = float(np.mean(repeats)) if repeats else None
    repeat = float(np.ptp(repeats)) if len(repeats) > 1 else None
    error = None if measured is None or predicted is None else predicted / measured - 1.0
    return dict(quantity=quantity, marker=marker, measured=measured, repeat=repeat, predicted=predicted, error=error)


def _rms(vectors: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.sum(vectors**2, axis=-1))))


MOST_SECANT_STEPS, WAY_TOLERANCE = 12, 1e-4
"""Most equilibria, and the relative error of the way that ends the search."""


def calibrate(sink: Callable[[float], float], wanted: float) -> float:
    """Find the softness s with ``sink(s)`` = ``wanted`` [m]: how many times softer than assumed the body is.

    sink : the way [m] of the markers under the case's loads, for a body s times softer; it increases with s
    The secant method on way over softness, which bends little; NotConverged if the way is not met.
    """
    softness, history = [1.0], []
    ways = [sink(1.0)]
    for _ in range(MOST_SECANT_STEPS):
        history.append(abs(ways[-1] / wanted - 1.0))
        if history[-1] <= WAY_TOLERANCE:
            return softness[-1]
        if len(ways) == 1:
            following = wanted / ways[-1]
        else:
            slope = (ways[-1] - ways[-2]) / (softness[-1] - softness[-2])
            following = softness[-1] + (wanted - ways[-1]) / slope
        # never more than four times softer or stiffer at once: a beam that curls up has no slope left
        softness.append(min(max(following, softness[-1] / 4), 4 * softness[-1]))
        ways.append(sink(softness[-1]))
    raise NotConverged(f"no modulus lets the markers sink by {wanted:.3g} m; see loads, density and down", history)


MOST_INVERSE_ITERATIONS, EIGENVALUE_TOLERANCE, SOLVED = 60, 1e-4, 0.03
"""Most steps; relative error of ω² that ends them; relative residual of the linear solve in each."""


def natural_frequency(
    specimen: Specimen, x: np.ndarray, masses: sparse.csr_array, stiffer: float = 1.0
) -> tuple[float, np.ndarray]:
    """Return the frequency [Hz] of small oscillations around the equilibrium ``x`` (n, 3) [m], and their shape (n, 3).

    The smallest eigenvalue ω² of ``stiffer`` K v = ω² M v by inverse iteration, with Rayleigh's quotient and inexact
    solves, from the way that the release goes: it begins near the mode that the release excites, and keeps the
    symmetry of that, though a beam as wide as high has another mode of the same frequency across. With the residual
    r = ω² M v − K v, the relative error of ω² is about r·K⁻¹r / v·K v, which ends the steps.

    Raises NotConverged if it does not become small, and if the stiffness is not positive definite.
    """
    multiply, precondition = specimen.linearise(x)
    history: list[float] = []
    shape = x - specimen.rest
    shape[specimen.held] = 0.0
    for _ in range(MOST_INVERSE_ITERATIONS):
        shape = shape / np.sqrt(np.vdot(shape, masses @ shape))
        pull = multiply(shape)
        squared = float(np.vdot(shape, pull))
        left = squared * (masses @ shape) - pull
        left[specimen.held] = 0.0
        change, _, positive = conjugate_gradients(multiply, precondition, left, SOLVED, 1000)
        if not positive:
            unstable = "a body that has come to rest has a way to give in; its equilibrium is not stable"
            raise NotConverged(unstable, history)
        history.append(float(np.vdot(left, change)) / squared)
        if history[-1] <= EIGENVALUE_TOLERANCE:
            return float(np.sqrt(stiffer * squared)) / (2 * np.pi), shape
        shape = shape + change
    wrong = f"a frequency is still wrong by {history[-1]:.1e} after {MOST_INVERSE_ITERATIONS} steps"
    raise NotConverged(wrong, history)


@dataclass(eq=False)
class Predictor:
    """One specimen, and the equilibria that it has found so far, from which the next search begins.

    An equilibrium depends on the ratio of load and modulus alone: a body s times softer than the specimen, of softness
    s, is where the specimen is under s times the load.
    """

    experiment: Experiment
    observed: dict[str, Observed]
    specimen: Specimen

    def __post_init__(self) -> None:
        self.bench = Bench(self.specimen, self.experiment.compared)
        self._reached: dict[str, np.ndarray] = {}

    def settle(self, case: Case, softness: float) -> np.ndarray:
        """Return the equilibrium (n, 3) [m] of a case for a body so many times softer than the specimen."""
        load = softness * self.bench.load(case.weights, self.observed[case.name].down)
        nearest = self._reached.get(case.name, next(reversed(self._reached.values()), None))
        self._reached[case.name] = self.specimen.settle(load, nearest)
        return self._reached[case.name]

    def softness(self, case: Case, less_m: float = 0.0) -> float:
        """Fit the softness to how far the markers of a case sank, less ``less_m`` [m]; errors as ``calibrate``."""
        seen = self.observed[case.name]

        def sink(softness: float) -> float:
            return float((self.bench.moves(self.settle(case, softness)) @ seen.axis).mean())

        return calibrate(sink, seen.sink_m - less_m)

    def frequency(self, case: Case, x: np.ndarray, softness: float) -> float:
        """Return the frequency [Hz] at the equilibrium ``x`` (n, 3) [m] of a case."""
        return natural_frequency(self.specimen, x, self.bench.masses(case.weights), 1.0 / softness)[0]

    def rows(self, calibrated: str) -> Iterator[Row]:
        """Yield what is predicted of all cases with E as given or ``calibrated`` on a case; errors are messages."""
        known, softness, message = {case.name: case for case in self.experiment.cases}, 1.0, ""
        if calibrated != GIVEN:
            try:
                softness = self.softness(known[calibrated])
            except NotConverged as failure:
                message = str(failure)
        for case in self.experiment.cases:
            yield from self._case(case, calibrated, softness, message)

    def _case(self, case: Case, calibrated: str, softness: float, message: str) -> Iterator[Row]:
        moves, hz = None, None
        if not message:
            try:
                x = self.settle(case, softness)
                moves = self.bench.moves(x)
                hz = self.frequency(case, x, softness) if case.swings else None
            except NotConverged as failure:
                message = str(failure)
        about: Row = {"case": case.name, "calibrated": calibrated, "softness": softness, "message": message}
        for row in compare_moves(self.experiment, self.observed[case.name], moves):
            fitted = case.name == calibrated and row["quantity"] == "sink_m" and row["marker"] == ALL
            yield about | row | {"fitted": fitted}
        if case.swings:
            for row in compare_swing(self.observed[case.name], {"frequency_hz": hz}):
                yield about | row


def creep_rows(predictor: Predictor, fitted: Case) -> Iterator[Row]:
    """Yield frequency and creep of all cases, from two moduli that are fitted to one case.

    The relaxed modulus lets the markers settle where they did, the instantaneous one where they would be without what
    the record still creeps. As the material keeps its volume, creep is one factor on the whole stiffness, that of a
    generalised Maxwell body whose times are longer than a swing; what a case creeps is the difference of two
    equilibria. Nothing is yielded without creep in the records, and if a modulus is not found.
    """
    crept = predictor.observed[fitted.name].creep_m
    if not crept > 0.0:
        return
    try:
        relaxed, sudden = predictor.softness(fitted), predictor.softness(fitted, less_m=crept)
    except NotConverged:
        return
    for case in predictor.experiment.swinging:
        seen, found = predictor.observed[case.name], dict.fromkeys(("frequency_hz", "creep_m"))
        about: Row = {"case": case.name, "calibrated": fitted.name, "softness": sudden, "message": ""}
        try:
            far = predictor.bench.moves(predictor.settle(case, relaxed))
            x = predictor.settle(case, sudden)
            creep_m = float(((far - predictor.bench.moves(x)) @ seen.axis).mean())
            found = {"frequency_hz": predictor.frequency(case, x, sudden), "creep_m": creep_m}
        except NotConverged as failure:
            about["message"] = str(failure)
        for row in compare_swing(seen, found):
            yield about | row | {"fitted": case is fitted and row["quantity"] == "creep_m"}


def damping_rows(
    experiment: Experiment, observed: Mapping[str, Observed], frequencies: Mapping[str, float | None], fitted: str
) -> Iterator[tuple[str, Row]]:
    """Yield each kind of damping with its rows, from predicted ``frequencies`` [Hz] of cases.

    A mode of ω is damped by α/2ω with Rayleigh's damping matrix α M, and by β ω/2 with β K.
    """
    swings, own = observed[fitted].swings, frequencies.get(fitted)
    if not swings or own is None:
        return
    ratio = sum(swing.damping_ratio for swing in swings) / len(swings)
    for kind, power in {"mass": -1.0, "stiffness": 1.0}.items():
        for case in experiment.swinging:
            hz = frequencies.get(case.name)
            predicted = None if hz is None else ratio * (hz / own) ** power
            for row in compare_swing(observed[case.name], {"damping_ratio": predicted}):
                yield kind, {"case": case.name, "calibrated": fitted} | row | {"fitted": case.name == fitted}
