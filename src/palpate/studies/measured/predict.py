"""Predict all cases of an experiment with one model, with Young's modulus as given and fitted to one of them."""

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from scipy import sparse

from palpate.errors import NotConverged
from palpate.linalg.multigrid import conjugate_gradients
from palpate.studies.measured.records import Observed, compared, swinging
from palpate.studies.measured.settings import ExperimentSettings
from palpate.studies.measured.specimen import Bench, Specimen

ALL, GIVEN = "all", "no"
"""The name of the mean over markers; the value of ``calibrated`` where Young's modulus is that of the settings."""
Row = dict[str, Any]


def compare_moves(experiment: ExperimentSettings, seen: Observed, moves: np.ndarray | None) -> Iterator[Row]:
    """Yield rows that compare the displacements ``moves`` (m, 3) [m] of markers, None without a prediction.

    sink_m is the displacement downwards, of each marker and on average; move_m the length of the displacement (RMS over
    markers), whose error is the RMS length of the difference and never negative.
    """
    measured_moves = [repeat.moves for repeat in seen.repeats]
    sinks = [each @ seen.axis for each in measured_moves]
    sunk = None if moves is None else moves @ seen.axis
    yield _row("sink_m", ALL, [float(s.mean()) for s in sinks], None if sunk is None else float(sunk.mean()))
    for i, name in enumerate(compared(experiment)):
        yield _row("sink_m", name, [float(s[i]) for s in sinks], None if sunk is None else float(sunk[i]))
    measured = None if seen.moves is None else _rms(seen.moves)
    repeat = max((_rms(a - b) for a, b in combinations(measured_moves, 2)), default=None)
    error = None if measured is None or moves is None else _rms(moves - seen.moves) / measured
    predicted = None if moves is None else _rms(moves)
    yield dict(quantity="move_m", marker=ALL, measured=measured, repeat=repeat, predicted=predicted, error=error)


def compare_swing(
    seen: Observed, swing: Mapping[str, float | None], about: Row, fitted: Collection[str] = ()
) -> Iterator[Row]:
    """Yield a row for each predicted quantity of ``swing``, fields of ``Oscillation`` by name; None if that failed.

    about : what all rows have; fitted : quantities that were fitted
    """
    for quantity, predicted in swing.items():
        repeats = [float(getattr(each, quantity)) for each in seen.swings]
        yield about | _row(quantity, ALL, repeats, predicted) | {"fitted": quantity in fitted}


def _row(quantity: str, marker: str, repeats: list[float], predicted: float | None) -> Row:
    """Return the mean of ``repeats``, the widest difference between two, and the relative error of ``predicted``."""
    measured = float(np.mean(repeats)) if repeats else None
    repeat = float(np.ptp(repeats)) if len(repeats) > 1 else None
    error = None if measured is None or predicted is None else predicted / measured - 1.0
    return dict(quantity=quantity, marker=marker, measured=measured, repeat=repeat, predicted=predicted, error=error)


def _rms(vectors: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.sum(vectors**2, axis=-1))))


MOST_SECANT_STEPS, SINK_TOLERANCE = 12, 1e-4
"""Most equilibria, and the relative error of the markers' displacement that ends the search."""


def calibrate(sink: Callable[[float], float], wanted: float) -> float:
    """Find the softness s with ``sink(s)`` = ``wanted`` [m] by the secant method; NotConverged if there is none.

    sink : mean displacement [m] of the markers of a body that is s times softer than assumed; it increases with s
    """
    softness, history = [1.0], []
    sunk = [sink(1.0)]
    for _ in range(MOST_SECANT_STEPS):
        history.append(abs(sunk[-1] / wanted - 1.0))
        if history[-1] <= SINK_TOLERANCE:
            return softness[-1]
        if len(sunk) == 1:
            next_softness = wanted / sunk[-1]
        else:
            slope = (sunk[-1] - sunk[-2]) / (softness[-1] - softness[-2])
            next_softness = softness[-1] + (wanted - sunk[-1]) / slope
        # never more than four times softer or stiffer at once: a beam that curls up has no slope left
        softness.append(min(max(next_softness, softness[-1] / 4), 4 * softness[-1]))
        sunk.append(sink(softness[-1]))
    raise NotConverged(f"no modulus lets the markers sink by {wanted:.3g} m; see loads, density and down", history)


MOST_INVERSE_ITERATIONS, EIGENVALUE_TOLERANCE, SOLVED = 60, 1e-4, 0.03
"""Most steps; relative error of ω² that ends them; relative residual of the linear solve in each."""


def natural_frequency(
    specimen: Specimen, x: np.ndarray, masses: sparse.csr_array, stiffer: float = 1.0
) -> tuple[float, np.ndarray]:
    """Return the lowest frequency [Hz] of small oscillations around the equilibrium ``x`` (n, 3) [m], and its mode.

    masses : (n, n) [kg]; stiffer : factor of the stiffness
    Inverse iteration for the smallest eigenvalue ω² of ``stiffer`` K v = ω² M v, with Rayleigh's quotient and inexact
    solves. It begins with the displacement from rest, near the mode that the release excites, whose symmetry it keeps:
    a beam as wide as high has another mode of the same frequency. The relative error of ω² is about r·K⁻¹r / v·K v with
    the residual r = ω² M v − K v; it ends the iteration.
    Raises NotConverged if it does not become small, and if the stiffness is not positive definite.
    """
    multiply, precondition = specimen.linearise(x)
    history: list[float] = []
    shape = x - specimen.rest
    shape[specimen.held] = 0.0
    for _ in range(MOST_INVERSE_ITERATIONS):
        shape = shape / np.sqrt(np.vdot(shape, masses @ shape))
        pull = multiply(shape)
        omega2 = float(np.vdot(shape, pull))
        residual = omega2 * (masses @ shape) - pull
        residual[specimen.held] = 0.0
        change, _, positive = conjugate_gradients(multiply, precondition, residual, SOLVED, 1000)
        if not positive:
            reason = "a body that has come to rest has a way to give in; its equilibrium is not stable"
            raise NotConverged(reason, history)
        history.append(float(np.vdot(residual, change)) / omega2)
        if history[-1] <= EIGENVALUE_TOLERANCE:
            return float(np.sqrt(stiffer * omega2)) / (2 * np.pi), shape
        shape = shape + change
    message = f"a frequency is still wrong by {history[-1]:.1e} after {MOST_INVERSE_ITERATIONS} steps"
    raise NotConverged(message, history)


@dataclass(eq=False)
class Predictor:
    """Predictions of one specimen, each of whose equilibria starts the search for the next.

    An equilibrium depends on the ratio of load and modulus alone: a body of softness s, s times softer than the
    specimen, is in equilibrium where the specimen is under s times the load.
    """

    experiment: ExperimentSettings
    observed: dict[str, Observed]
    specimen: Specimen

    def __post_init__(self) -> None:
        self.bench = Bench(self.specimen, list(compared(self.experiment).values()))
        self._reached: dict[str, np.ndarray] = {}

    def settle(self, case: str, softness: float) -> np.ndarray:
        """Return the equilibrium (n, 3) [m] of a case for a body so many times softer than the specimen."""
        load = softness * self.bench.load(self.experiment.cases[case].loads, self.observed[case].down)
        nearest = self._reached.get(case, next(reversed(self._reached.values()), None))
        self._reached[case] = self.specimen.settle(load, nearest)
        return self._reached[case]

    def softness(self, case: str, less_m: float = 0.0) -> float:
        """Fit the softness to the mean displacement of a case's markers, less ``less_m`` [m]; see ``calibrate``."""
        seen = self.observed[case]

        def sink(softness: float) -> float:
            return float((self.bench.moves(self.settle(case, softness)) @ seen.axis).mean())

        return calibrate(sink, seen.sink_m - less_m)

    def frequency(self, case: str, x: np.ndarray, softness: float) -> float:
        """Return the frequency [Hz] at the equilibrium ``x`` (n, 3) [m] of a case."""
        return natural_frequency(
            self.specimen, x, self.bench.masses(self.experiment.cases[case].loads), 1.0 / softness
        )[0]

    def rows(self, calibrated: str) -> Iterator[Row]:
        """Yield the predictions of all cases, with Young's modulus as given or fitted to the case ``calibrated``."""
        softness, message = 1.0, ""
        if calibrated != GIVEN:
            try:
                softness = self.softness(calibrated)
            except NotConverged as failure:
                message = str(failure)
        for case in self.experiment.cases:
            yield from self._case(case, calibrated, softness, message)

    def _case(self, case: str, calibrated: str, softness: float, message: str) -> Iterator[Row]:
        """Yield the rows of one case for a body of ``softness``; with a ``message`` there is no prediction."""
        moves, hz, swings = None, None, self.experiment.cases[case].swings
        if not message:
            try:
                x = self.settle(case, softness)
                moves = self.bench.moves(x)
                hz = self.frequency(case, x, softness) if swings else None
            except NotConverged as failure:
                message = str(failure)
        about: Row = {"case": case, "calibrated": calibrated, "softness": softness, "message": message}
        for row in compare_moves(self.experiment, self.observed[case], moves):
            fitted = case == calibrated and row["quantity"] == "sink_m" and row["marker"] == ALL
            yield about | row | {"fitted": fitted}
        if swings:
            yield from compare_swing(self.observed[case], {"frequency_hz": hz}, about)


def creep_rows(predictor: Predictor, fitted: str) -> Iterator[Row]:
    """Yield the predicted frequency and creep of all cases, from two moduli that are fitted to one case.

    The relaxed modulus is fitted to where the markers settle, the instantaneous one to where they would settle without
    the creep of the record. As the material keeps its volume, creep is one factor of the whole stiffness, that of a
    generalised Maxwell body whose times are longer than an oscillation; the creep of a case is the difference of two
    equilibria. Nothing is yielded without creep in the records, or if a modulus is not found.
    """
    crept = predictor.observed[fitted].creep_m
    if not crept > 0.0:
        return
    try:
        relaxed, instantaneous = predictor.softness(fitted), predictor.softness(fitted, less_m=crept)
    except NotConverged:
        return
    for case in swinging(predictor.experiment):
        seen, predicted = predictor.observed[case], dict.fromkeys(("frequency_hz", "creep_m"))
        about: Row = {"case": case, "calibrated": fitted, "softness": instantaneous, "message": ""}
        try:
            settled = predictor.bench.moves(predictor.settle(case, relaxed))
            x = predictor.settle(case, instantaneous)
            creep_m = float(((settled - predictor.bench.moves(x)) @ seen.axis).mean())
            predicted = {"frequency_hz": predictor.frequency(case, x, instantaneous), "creep_m": creep_m}
        except NotConverged as failure:
            about["message"] = str(failure)
        yield from compare_swing(seen, predicted, about, ("creep_m",) if case == fitted else ())


def damping_rows(
    predictor: Predictor, frequencies: Mapping[str, float | None], fitted: str, about: Row
) -> Iterator[Row]:
    """Yield a row for each kind of Rayleigh damping and prediction of a damping ratio.

    frequencies : predicted ones [Hz] by case; fitted : name of the case whose mean damping ratio α or β is fitted to
    about : the row of another quantity of the model
    A mode of frequency ω is damped by the ratio α/2ω with the damping matrix α M, and by β ω/2 with β K.
    """
    swings, fitted_hz = predictor.observed[fitted].swings, frequencies.get(fitted)
    if not swings or fitted_hz is None:
        return
    ratio = sum(swing.damping_ratio for swing in swings) / len(swings)
    for kind, power in {"mass": -1.0, "stiffness": 1.0}.items():
        for case in swinging(predictor.experiment):
            hz = frequencies.get(case)
            predicted = None if hz is None else ratio * (hz / fitted_hz) ** power
            row = about | {"case": case, "setting": f"{about['setting']} damping={kind}"}
            ratios = {"damping_ratio": predicted}
            yield from compare_swing(predictor.observed[case], ratios, row, ratios if case == fitted else ())
