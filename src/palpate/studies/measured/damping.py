"""Damping ratios that follow from Rayleigh's damping, fitted to one case."""

from collections.abc import Iterator, Mapping

from palpate.studies.measured.experiment import Experiment
from palpate.studies.measured.measured_rows import Row, compare_swing
from palpate.studies.measured.observed import Observed

POWERS = {"mass": -1.0, "stiffness": 1.0}
"""Rayleigh's two kinds of damping, and the power of the frequency that their damping ratio is proportional to."""


def damping_rows(
    experiment: Experiment, observed: Mapping[str, Observed], frequencies: Mapping[str, float | None], fitted: str
) -> Iterator[tuple[str, Row]]:
    """Yield each kind of damping with its rows, from predicted ``frequencies`` [Hz] of cases.

    A mode of ω is damped by α/2ω with a damping matrix α M, and by β ω/2 with β K.
    """
    swings = [repeat.swing for repeat in observed[fitted].repeats if repeat.swing is not None]
    own = frequencies.get(fitted)
    if not swings or own is None:
        return
    ratio = sum(swing.damping_ratio for swing in swings) / len(swings)
    for kind, power in POWERS.items():
        for case in (case for case in experiment.cases if case.swings):
            hz = frequencies.get(case.name)
            predicted = None if hz is None else ratio * (hz / own) ** power
            for row in compare_swing(observed[case.name], {"damping_ratio": predicted}):
                yield kind, {"case": case.name, "calibrated": fitted} | row | {"fitted": case.name == fitted}
