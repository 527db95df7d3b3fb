"""Creep: a body that creeps is stiffer while it swings than when it has settled."""

from collections.abc import Iterator

import numpy as np

from palpate.errors import NotConverged
from palpate.studies.measured.experiment import Case
from palpate.studies.measured.measured_rows import Row, axis_down, compare_swing
from palpate.studies.measured.predict import Predictor


def creep_rows(predictor: Predictor, fitted: Case) -> Iterator[Row]:
    """Yield frequency and creep of all cases, from two moduli that are fitted to one case.

    The relaxed modulus lets the markers settle where they did, the instantaneous one where they would be without what
    the record still creeps. As the material keeps its volume, creep is one factor on the whole stiffness, that of a
    generalised Maxwell body whose times are longer than a swing; what a case creeps is the difference of two
    equilibria. Nothing is yielded without creep in the records, and if a modulus is not found.
    """
    swings = [repeat.swing for repeat in predictor.observed[fitted.name].repeats if repeat.swing is not None]
    crept = float(np.mean([swing.creep_m for swing in swings])) if swings else 0.0
    if not crept > 0.0:
        return
    try:
        relaxed, sudden = predictor.softness(fitted), predictor.softness(fitted, less_m=crept)
    except NotConverged:
        return
    for case in (case for case in predictor.experiment.cases if case.swings):
        seen, found = predictor.observed[case.name], dict.fromkeys(("frequency_hz", "creep_m"))
        about: Row = {"case": case.name, "calibrated": fitted.name, "softness": sudden, "message": ""}
        try:
            found = _swing(predictor, case, relaxed, sudden)
        except NotConverged as failure:
            about["message"] = str(failure)
        for row in compare_swing(seen, found):
            yield about | row | {"fitted": case is fitted and row["quantity"] == "creep_m"}


def _swing(predictor: Predictor, case: Case, relaxed: float, sudden: float) -> dict[str, float | None]:
    axis = axis_down(predictor.observed[case.name].down)
    far = predictor.bench.moves(predictor.settle(case, relaxed))
    x = predictor.settle(case, sudden)
    crept = float(((far - predictor.bench.moves(x)) @ axis).mean())
    return {"frequency_hz": predictor.frequency(case, x, sudden), "creep_m": crept}
