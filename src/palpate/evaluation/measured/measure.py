"""Put every model beside one experiment: the rows of measured.csv."""

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import pandas as pd

from palpate.bodies.body import Body
from palpate.errors import InputError
from palpate.evaluation.measured.candidates import Candidate, candidates
from palpate.evaluation.measured.creep import creep_rows
from palpate.evaluation.measured.damping import damping_rows
from palpate.evaluation.measured.experiment import Experiment
from palpate.evaluation.measured.measured_rows import Row
from palpate.evaluation.measured.observed import Observed, observe_all
from palpate.evaluation.measured.predict import GIVEN, Predictor
from palpate.evaluation.measured.release_rows import release_rows
from palpate.evaluation.measured.tables import TABLES


def measure(experiment: Experiment, body: Body, settings: Mapping[str, Any], progress: Callable = iter) -> pd.DataFrame:
    """Tabulate measured.csv for one experiment: a row a case, model, setting, calibration, quantity and marker.

    settings : ``measured.models`` of the config; ``progress`` wraps the models, as ``tqdm`` does
    Raises InputError for files that do not fit the entry, and for a body that the models cannot treat; a model that
    does not converge has rows with a message and no prediction.
    """
    if not len(body.coarse.tetrahedra):
        raise InputError(f"measured.experiments.{experiment.name}: {body.name} is a sheet; name a body of tetrahedra.")
    rows: list[Row] = []
    observed = observe_all(experiment)
    for candidate in progress(list(candidates(body, settings))):
        rows += _of(candidate, experiment, observed)
    rows += release_rows(experiment, observed, body, settings["releases"])
    table = pd.DataFrame(rows).assign(body=body.name, experiment=experiment.name)
    table["young_pa"] = table["young_pa"] / table["softness"]
    table["fitted"] = table["fitted"].eq(True)
    table["message"] = table["message"].fillna("")
    return table[TABLES["measured"].columns.split()]


def _of(candidate: Candidate, experiment: Experiment, observed: dict[str, Observed]) -> Iterator[Row]:
    """Yield the rows of one model, with E as given and fitted, and of one also of creep and of kinds of damping."""
    predictor, own = Predictor(experiment, observed, candidate.make()), candidate.body.material
    about: Row = {"model": candidate.model, "setting": candidate.setting, "nodes": len(predictor.specimen.rest)}
    about |= {"young_pa": own.young_pa, "poisson": own.poisson, "law": own.law, "softness": 1.0}
    for row in predictor.rows(GIVEN):
        yield about | row
    fitted = experiment.fitted
    if fitted is None:
        return
    found = [about | row for row in predictor.rows(fitted.name)]
    yield from found
    if not candidate.asked_more:
        return
    for row in creep_rows(predictor, fitted):
        yield about | {"setting": f"{candidate.setting} creep"} | row
    known = found[0] | {"marker": None}
    frequencies = {str(row["case"]): row["predicted"] for row in found if row["quantity"] == "frequency_hz"}
    for kind, row in damping_rows(experiment, observed, frequencies, fitted.name):
        yield known | {"setting": f"{candidate.setting} damping={kind}"} | row
