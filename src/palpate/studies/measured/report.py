"""Report on models beside measured bodies: what each predicts, and what it cannot."""

from collections.abc import Iterator
from typing import Any

import pandas as pd

from palpate.report import tables
from palpate.report.model_looks import look
from palpate.report.report import Report
from palpate.report.words import listed, spaced
from palpate.studies.measured.experiment import GIVEN
from palpate.studies.measured.figures.models import named
from palpate.studies.measured.measure import MEASURED
from palpate.studies.measured.report_of_presses import pressed, relaxing

TITLE = "Models beside a measured body"
QUANTITIES = {"sink_m": "place", "frequency_hz": "frequency", "damping_ratio": "damping ratio"}
COVER = 2.0
"""Standard uncertainties that an error may have and still agree with the measurement: 95 % of a normal distribution."""
NOTHING = MEASURED.frame([])
PLAIN = r"level=\d+"
"""The setting of a model without another law, Poisson's ratio or kind of motion."""
OF_ONE_MESH = r"level=0( (law|poisson)=\S+)?"


def numbers(report: Report) -> dict[str, Any]:
    """Return what the template names: the answers of each experiment."""
    table = report.tables.get("measured", NOTHING)
    return {
        "experiments": [_experiment(tables.where(table, experiment=one)) for one in dict.fromkeys(table["experiment"])],
        "pressed": list(pressed(report)),
        "relaxing": list(relaxing(report)),
    }


def _experiment(rows: pd.DataFrame) -> dict[str, Any]:
    """Return the answers of one experiment: predictions, locking, laws, creep, and damping."""
    every = rows[rows["marker"].eq("all") & rows["error"].notna()]
    fitted = every[every["calibrated"].ne(GIVEN) & every["case"].ne(every["calibrated"])]
    sunk = fitted[fitted["quantity"].eq("sink_m")]
    free = tables.where(every, calibrated=GIVEN, quantity="sink_m")
    free = free[free["setting"].str.fullmatch(PLAIN) & free["case"].eq(free["case"].iloc[0] if len(free) else "")]
    finest = sunk[sunk["setting"].str.fullmatch(PLAIN)].sort_values("nodes", kind="stable")
    laws = sunk[sunk["model"].eq("fem_p2") & sunk["setting"].str.fullmatch(OF_ONE_MESH)]
    ratios = every[every["quantity"].eq("damping_ratio")]
    apart = every.drop_duplicates(["case", "quantity"]).dropna(subset=["repeat"])
    untested = rows[rows["measured"].isna() & rows["predicted"].notna() & rows["marker"].eq("all")]
    untested = untested.assign(model=[named(row) for row in untested.itertuples()])
    return {
        "key": rows["experiment"].iloc[0],
        "name": spaced(str(rows["experiment"].iloc[0])),
        **_predicted(fitted),
        "crept": _errors(every[every["setting"].str.endswith(" creep") & every["quantity"].eq("frequency_hz")]),
        "branched": _errors(every[every["setting"].str.contains(" prony ") & every["quantity"].eq("creep_m")]),
        "given": _errors(free, named),
        "finest": _errors(finest.drop_duplicates(["case", "model"], keep="last"), lambda row: look(row.model).label),
        "laws": [
            {"case": spaced(str(case)), "least": part["error"].min(), "most": part["error"].max()}
            for case, part in laws.groupby("case", sort=False)
            if len(part) > 1
        ],
        "counts": (laws["law"].nunique(), laws["poisson"].nunique()),
        "stepped": _ratios(ratios[ratios["setting"].str.contains("step_s=", regex=False)]),
        "damped": _ratios(ratios[ratios["setting"].str.contains("damping=", regex=False) & ratios["fitted"].eq(False)]),
        "repeats": [
            {"apart": row.repeat / abs(row.measured), "what": QUANTITIES[row.quantity], "case": spaced(row.case)}
            for row in apart[apart["quantity"].isin(QUANTITIES)].itertuples()
        ],
        "untested": untested[["case", "model", "calibrated", "quantity", "predicted"]],
    }


def _predicted(fitted: pd.DataFrame) -> dict[str, Any]:
    """Return how well quadratic elements on the finest mesh predict the cases that they were not fitted to."""
    model = fitted[fitted["model"].eq("fem_p2") & fitted["setting"].str.fullmatch(PLAIN)]
    model = model[model["quantity"].isin(["sink_m", "frequency_hz"])]
    nodes = model["nodes"].max()
    predicted = []
    for row in model[model["nodes"].eq(nodes)].itertuples():
        coarser = tables.where(model[model["nodes"].lt(nodes)], case=row.case, quantity=row.quantity)
        beside = coarser.loc[coarser["nodes"].idxmax()] if len(coarser) else None
        predicted.append(
            {
                "what": QUANTITIES[str(row.quantity)],
                "case": spaced(str(row.case)),
                "error": abs(row.error),
                "uncertainty": row.uncertainty,
                "coarser": None if beside is None else (abs(beside["error"]), int(beside["nodes"])),
            }
        )
    excluded = [f"the {row['what']} of {row['case']}" for row in predicted if row["error"] > COVER * row["uncertainty"]]
    on = spaced(str(model["calibrated"].iloc[0])) if len(model) else ""
    return {"predicted": predicted, "excluded": listed(excluded), "fitted": on}


def _errors(rows: pd.DataFrame, name=lambda row: "") -> list[dict[str, Any]]:
    """Return signed errors, by case and by what ``name`` makes of a row."""
    return [{"error": row.error, "case": spaced(row.case), "of": name(row)} for row in rows.itertuples()]


def _ratios(rows: pd.DataFrame) -> list[dict[str, Any]]:
    return [
        {"found": row.predicted, "wanted": row.measured, "case": spaced(row.case), "how": named(row).split(", ")[-1]}
        for row in rows.itertuples()
    ]


def failures(report: Report) -> Iterator[tuple[str, str, str]]:
    """Yield the models that gave no answer: what, where, how."""
    table = report.tables.get("measured", NOTHING)
    silent = table[table["message"].notna() & table["message"].ne("")]
    for row in silent.drop_duplicates(["experiment", "case", "model", "setting"]).itertuples():
        yield named(row), f"{spaced(row.experiment)}, {spaced(row.case)}", row.message
