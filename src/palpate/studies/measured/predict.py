"""Predict every case of an experiment with one model: with E as given, and with E fitted to one case."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from palpate.errors import NotConverged
from palpate.studies.measured.calibrate import calibrate
from palpate.studies.measured.experiment import Case, Experiment
from palpate.studies.measured.measured_rows import ALL, Row, axis_down, compare_moves, compare_swing
from palpate.studies.measured.natural_frequency import natural_frequency
from palpate.studies.measured.observed import Observed
from palpate.studies.measured.specimen import Bench, Specimen

GIVEN = "no"
"""The word for a modulus that is fitted to no case."""


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
        self.bench = Bench(self.specimen, self.experiment.compared, self.experiment.gravity_m_s2)
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
        axis, moves = axis_down(seen.down), seen.moves
        assert moves is not None  # a case with files

        def sink(softness: float) -> float:
            return float((self.bench.moves(self.settle(case, softness)) @ axis).mean())

        return calibrate(sink, float((moves @ axis).mean()) - less_m)

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
