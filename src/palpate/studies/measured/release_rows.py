"""Rows of releases that are computed in time: what backward Euler damps, and creep by the Prony effect."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from palpate.bodies.body import Body
from palpate.errors import InputError, NotConverged
from palpate.studies.measured.experiment import Experiment
from palpate.studies.measured.measured_rows import Row, axis_down, compare_swing
from palpate.studies.measured.observed import Observed
from palpate.studies.measured.predict import GIVEN, Predictor
from palpate.studies.measured.release import Release
from palpate.studies.measured.specimen import FemSpecimen

DAMPED, CREPT = ("frequency_hz", "damping_ratio"), ("creep_m", "creep_s")
"""The quantities that are compared, without and with the Prony effect."""


def release_rows(
    experiment: Experiment, observed: Mapping[str, Observed], body: Body, settings: Mapping[str, Any]
) -> Iterator[Row]:
    """Yield rows of linear elements whose modulus is fitted to one case, if any, for each of the steps.

    settings : ``measured.models.releases``; with ``creep``, also a release with one Prony branch that is fitted to the
        creep of that case. A release that is not computed has a message.
    """
    level, steps = settings["level"], list(settings["steps_s"])
    crept = _crept(experiment, observed) if settings["creep"] is not None else 0.0
    if not (steps or crept > 0.0):
        return
    predictor = Predictor(experiment, dict(observed), FemSpecimen(body, level, 1))
    fitted, own = experiment.fitted, body.material
    about: Row = {"model": "fem_p1", "nodes": len(predictor.specimen.rest), "young_pa": own.young_pa}
    about |= {"poisson": own.poisson, "law": own.law, "calibrated": GIVEN if fitted is None else fitted.name}
    try:
        softness = 1.0 if fitted is None else predictor.softness(fitted)
    except NotConverged as failure:
        yield about | {"setting": f"level={level}", "softness": 1.0, "message": str(failure)}
        return
    about |= {"softness": softness}
    for step_s in steps:
        release = Release(body, level, predictor.bench, softness, step_s, settings["duration_s"])
        yield from _rows(release, experiment, observed, about | {"setting": f"level={level} step_s={step_s:g}"}, DAMPED)
    if crept > 0.0:
        creep = settings["creep"]
        prony = _series(experiment, observed, crept, own.poisson)
        release = Release(body, level, predictor.bench, softness, creep["step_s"], creep["duration_s"], prony)
        about |= {"setting": f"level={level} prony step_s={creep['step_s']:g}"}
        yield from _rows(release, experiment, observed, about, CREPT)


def _rows(
    release: Release, experiment: Experiment, observed: Mapping[str, Observed], about: Row, names: tuple[str, ...]
) -> Iterator[Row]:
    for case in (case for case in experiment.cases if case.swings):
        found, message = dict.fromkeys(names), ""
        try:
            swing = release.swing(case.weights, experiment.gravity_m_s2 * observed[case.name].down)
            found = {name: getattr(swing, name) for name in names}
        except (NotConverged, InputError) as failure:
            message = str(failure)
        for row in compare_swing(observed[case.name], found):
            fitted = release.prony is not None and case is experiment.fitted
            yield about | {"case": case.name, "message": message, "fitted": fitted} | row


def _crept(experiment: Experiment, observed: Mapping[str, Observed]) -> float:
    """Return the mean creep [m] of the case that is fitted to; 0 if it shows none."""
    swings = _swings(experiment, observed)
    return float(np.mean([swing.creep_m for swing in swings])) if swings else 0.0


def _swings(experiment: Experiment, observed: Mapping[str, Observed]) -> list:
    repeats = [] if experiment.fitted is None else observed[experiment.fitted.name].repeats
    return [repeat.swing for repeat in repeats if repeat.swing is not None]


def _series(experiment: Experiment, observed: Mapping[str, Observed], crept: float, poisson: float) -> dict:
    """Return the branch with which a beam creeps so far and in that time.

    In bending and in tension the modulus falls by the share c = 2 (1 + ν) g / 3, as the bulk modulus stays, and a held
    load creeps by c of the whole way in the time τ / (1 − g).
    """
    assert experiment.fitted is not None  # it has crept
    seen = observed[experiment.fitted.name]
    assert seen.moves is not None
    whole = float((seen.moves @ axis_down(seen.down)).mean())
    share = 3.0 * crept / whole / (2.0 * (1.0 + poisson))
    time = float(np.mean([swing.creep_s for swing in _swings(experiment, observed)]))
    return {"shares": [share], "times_s": [time * (1.0 - share)]}
