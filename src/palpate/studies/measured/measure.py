"""Compare every model with one experiment: the rows of measured.csv."""

import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from palpate.bodies import body_file
from palpate.bodies.body import Body
from palpate.run.job import steps
from palpate.studies.measured.check_places import check_places
from palpate.studies.measured.predict import ALL, GIVEN, Predictor, Row, creep_rows, damping_rows
from palpate.studies.measured.records import Observed, observe_all
from palpate.studies.measured.release import release_rows
from palpate.studies.measured.settings import ExperimentSettings, Models
from palpate.studies.measured.specimen import FemSpecimen, Specimen, SpringSpecimen
from palpate.table_declaration import Table


@dataclass(frozen=True, eq=False)
class Candidate:
    """A model of ``body`` with a setting, whose specimen ``make`` builds.

    extended : whether it also predicts what follows from creep and from kinds of damping
    """

    model: str
    setting: str
    body: Body
    make: Callable[[], Specimen]
    extended: bool = False


def candidates(body: Body, settings: Models) -> Iterator[Candidate]:
    """Yield the models of ``body``: linear and quadratic elements on several levels, and springs.

    Quadratic elements on the coarsest level are also tried with other Poisson's ratios and laws.
    settings : ``measured.models`` of the config; where levels are null, all that the body has are taken
    """
    for order, model, levels in ((1, "fem_p1", settings.fem_p1.levels), (2, "fem_p2", settings.fem_p2.levels)):
        finest = len(body.levels) - order
        for number, level in enumerate(range(finest + 1) if levels is None else levels):
            make = partial(FemSpecimen, body, level, order)
            yield Candidate(model, f"level={level}", body, make, extended=order == 2 and number == 0)
    if len(body.levels) > 1:
        for poisson in settings.fem_p2.poissons:
            changed = replace(body, material=replace(body.material, poisson=poisson))
            yield Candidate("fem_p2", f"level=0 poisson={poisson:g}", changed, partial(FemSpecimen, changed, 0, 2))
        for law in settings.fem_p2.laws:
            changed = replace(body, material=replace(body.material, law=law))
            yield Candidate("fem_p2", f"level=0 law={law}", changed, partial(FemSpecimen, changed, 0, 2))
    for level in settings.springs.levels:
        yield Candidate("springs", f"level={level}", body, partial(SpringSpecimen, body, level))


FITS, LARGE = 0.03, 0.5
"""Misfit of the markers, and how far they sink, over the body's size, above which there is a warning."""

MEASURED = Table(
    "measured",
    "What was measured, how far repeats differ, and what each model predicts, with Young's modulus as given and "
    "fitted to one case.",
    """
    body case: a body, and a case of its loads
    model setting: a model, and its level, law, Poisson's ratio or way of motion
    calibrated: the case that Young's modulus is fitted to; "no" where it is as given
    quantity: sink_m and move_m of markers [m], frequency_hz [Hz], damping_ratio, creep_m [m], creep_s [s]
    measured repeat: mean of the repeats, and the widest difference between two
    predicted error: what the model says, and its error relative to what was measured
    uncertainty: standard uncertainty of that error, by the misfit of the held states and how far repeats differ
    experiment marker: an experiment, and a marker or "all" for their mean
    fitted: whether the value was fitted
    young_pa poisson law nodes: Young's modulus [Pa], Poisson's ratio, law, and number of nodes of the model
    misfit_m: distance (RMS) of the markers from their places at rest before the release [m]
    message: why there is no prediction
    """,
    always=False,
)


def measure(
    name: str, experiment: ExperimentSettings, body: Body, settings: Models, progress: Callable = iter
) -> pd.DataFrame:
    """Tabulate measured.csv for one experiment: a row a case, model, setting, calibration, quantity and marker.

    settings : ``measured.models`` of the config; progress : wraps the list of models, as ``tqdm`` does
    Raises InputError for files that do not fit the entry, and for loads and markers away from the body. A model that
    does not converge has rows with a message and without predictions. Warns of forces on a point, markers that fit
    badly, and predictions so large that the settings may be wrong.
    """
    check_places(name, experiment, body)
    rows: list[Row] = []
    observed = observe_all(experiment)
    for candidate in progress(list(candidates(body, settings))):
        rows += _rows(candidate, experiment, observed)
    rows += release_rows(experiment, observed, body, settings.releases)
    table = pd.DataFrame(rows).assign(body=body.name, experiment=name)
    table["young_pa"] = table["young_pa"] / table["softness"]
    table["fitted"] = table["fitted"].eq(True)
    table["message"] = table["message"].fillna("")
    table["misfit_m"] = table["case"].map({case: seen.misfit_m for case, seen in observed.items()}).astype(float)
    table["uncertainty"] = uncertainties(table, experiment, observed)
    for doubt in _suspicions(name, experiment, table, body.fine.size):
        warnings.warn(doubt, stacklevel=2)
    return table[MEASURED.columns]


POWERS_OF_SOFTNESS = {"sink_m": 1.0, "move_m": 1.0, "frequency_hz": -0.5}
"""Exponent of the softness that a prediction of small deflections is proportional to; large ones change less."""


def uncertainties(table: pd.DataFrame, experiment: ExperimentSettings, observed: Mapping[str, Observed]) -> pd.Series:
    """Return the standard uncertainty of each ``error``, a share; NaN for a fitted value or an unknown exponent.

    A displacement is as uncertain as the held state, a frequency as half of the range of the repeats. A fitted softness
    is as uncertain as the displacement that it was fitted to, and passes that on to predictions. ``part`` and
    ``passed_on`` are independent, as the body is held anew in each case.
    """
    power = table["quantity"].map(POWERS_OF_SOFTNESS).where(~table["fitted"])
    held = table["case"].map({name: seen.uncertainty_m for name, seen in observed.items()}).astype(float)
    part = held.where(table["quantity"].isin(["sink_m", "move_m"]), 0.5 * table["repeat"].fillna(0.0).astype(float))
    of_softness, fitted = 0.0, experiment.calibrate_on
    if fitted is not None:
        of_softness = observed[fitted].uncertainty_m / abs(observed[fitted].sink_m)
    passed_on = power.abs() * table["predicted"].astype(float).abs() * of_softness
    passed_on = passed_on.where(table["calibrated"].ne(GIVEN) & power.notna(), 0.0)
    return np.hypot(part, passed_on).where(power.notna()) / table["measured"].astype(float).abs()


def _rows(candidate: Candidate, experiment: ExperimentSettings, observed: dict[str, Observed]) -> Iterator[Row]:
    """Yield the rows of one model, with Young's modulus as given and as fitted, and its extended predictions."""
    predictor, material = Predictor(experiment, observed, candidate.make()), candidate.body.material
    about: Row = {"model": candidate.model, "setting": candidate.setting, "nodes": len(predictor.specimen.rest)}
    about |= {"young_pa": material.young_pa, "poisson": material.poisson, "law": material.law, "softness": 1.0}
    for row in predictor.rows(GIVEN):
        yield about | row
    fitted = experiment.calibrate_on
    if fitted is None:
        return
    rows = [about | row for row in predictor.rows(fitted)]
    yield from rows
    if not candidate.extended:
        return
    for row in creep_rows(predictor, fitted):
        yield about | {"setting": f"{candidate.setting} creep"} | row
    frequencies = {str(row["case"]): row["predicted"] for row in rows if row["quantity"] == "frequency_hz"}
    yield from damping_rows(predictor, frequencies, fitted, rows[0])


def _suspicions(name: str, experiment: ExperimentSettings, table: pd.DataFrame, size_m: float) -> Iterator[str]:
    """Yield warnings of settings that can be computed but are probably wrong, for a body of ``size_m`` [m]."""
    sunk = table[table["quantity"].eq("sink_m") & table["marker"].eq(ALL)]
    for key, case in experiment.cases.items():
        place, rows = f"measured.experiments.{name}.cases.{key}", sunk[sunk["case"].eq(key)]
        for number, load in enumerate(case.loads):
            if load.line_m is None and load.radius_m == 0.0:
                yield f"{place}.loads[{number}] acts on a point, where no mesh has an answer; give radius_m."
        if (misfit := float(rows["misfit_m"].max())) > FITS * size_m:
            yield (
                f"{place}: before the release the markers are {1e3 * misfit:.2g} mm (RMS) from their places at rest; "
                "see markers and held_s."
            )
        if (deepest := float(rows["predicted"].abs().max())) > LARGE * size_m:
            yield (
                f"{place}: its markers are predicted to sink by {1e3 * deepest:.3g} mm, and the body is "
                f"{1e3 * size_m:.3g} mm long; see weight_n and force_n (in N) and young_pa."
            )


def measure_experiment(
    input: Any, wildcards: Any, say: Callable, entry: ExperimentSettings, models: Models
) -> dict[str, pd.DataFrame]:
    """Compare the models with one experiment, for the rule of this name."""
    progress = steps(say, f"{wildcards.experiment}: model")
    return {"table": measure(wildcards.experiment, entry, body_file.load(input.body), models, progress)}
