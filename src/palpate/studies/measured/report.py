"""Compute what the report says of models beside measured bodies and of pressed tissue."""

from collections.abc import Iterator
from typing import Any

import pandas as pd

from palpate.report import tables
from palpate.report.report import Report
from palpate.report.words import spaced
from palpate.studies.measured.figures.models import named
from palpate.studies.measured.figures.presses import FLOORS, RIVALS, WAYS
from palpate.studies.measured.measure import MEASURED
from palpate.studies.measured.predict import GIVEN
from palpate.studies.measured.relaxed import MEAN, NOTHING, OWN, POWER, SIBLINGS

QUANTITIES = {"sink_m": "place", "frequency_hz": "frequency", "damping_ratio": "damping ratio"}
COVER = 2.0
"""Standard uncertainties that an error may have and still agree with the measurement: 95 % of a normal distribution."""
PLAIN = r"level=\d+"
"""The setting of a model without another law, Poisson's ratio or kind of motion."""
OF_ONE_MESH = r"level=0( (law|poisson)=\S+)?"


def numbers(report: Report) -> dict[str, Any]:
    """Return what the template names: the answers of each experiment."""
    table = report.tables.get("measured", MEASURED.frame([]))
    table = table.assign(of=[named(row) for row in table.itertuples()])
    silent = table[table["message"].fillna("") != ""]
    return {
        "experiments": [_experiment(str(name), rows) for name, rows in table.groupby("experiment", sort=False)],
        "silent": silent.drop_duplicates(["experiment", "case", "model", "setting"]),
        "pressed": list(_pressed(report)),
        "relaxing": list(_relaxing(report)),
    }


def _experiment(key: str, rows: pd.DataFrame) -> dict[str, Any]:
    """Return the rows of one experiment by what they answer: predictions, locking, laws, creep, and damping."""
    rows = rows[rows["marker"].eq("all")].assign(case=rows["case"].map(spaced))
    judged = rows[rows["error"].notna()]
    quantity, setting = judged["quantity"], judged["setting"]
    fitted = judged["calibrated"].ne(GIVEN) & judged["case"].ne(judged["calibrated"].map(spaced))
    plain = setting.str.fullmatch(PLAIN)
    as_given = judged[judged["calibrated"].eq(GIVEN) & quantity.eq("sink_m") & plain]
    finest = judged[fitted & quantity.eq("sink_m") & plain].sort_values("nodes", kind="stable")
    repeats = judged.drop_duplicates(["case", "quantity"]).dropna(subset=["repeat"])
    return {
        "key": key,
        "predicted": _predicted(judged[fitted & plain & judged["model"].eq("fem_p2")]),
        "crept": judged[setting.str.endswith(" creep") & quantity.eq("frequency_hz")],
        "branched": judged[setting.str.contains(" prony ") & quantity.eq("creep_m")],
        "given": as_given[as_given["case"].isin(as_given["case"].head(1))],
        "finest": finest.drop_duplicates(["case", "model"], keep="last"),
        "laws": judged[
            fitted & quantity.eq("sink_m") & judged["model"].eq("fem_p2") & setting.str.fullmatch(OF_ONE_MESH)
        ],
        "stepped": judged[quantity.eq("damping_ratio") & setting.str.contains("step_s=", regex=False)],
        "damped": judged[
            quantity.eq("damping_ratio") & setting.str.contains("damping=", regex=False) & judged["fitted"].eq(False)
        ],
        "repeats": repeats[repeats["quantity"].isin(QUANTITIES)].replace({"quantity": QUANTITIES}),
        "untested": rows[rows["measured"].isna() & rows["predicted"].notna()],
    }


def _predicted(rows: pd.DataFrame) -> pd.DataFrame:
    """Return how well quadratic elements on the finest mesh predict the cases that they were not fitted to."""
    rows = rows[rows["quantity"].isin(["sink_m", "frequency_hz"])].replace({"quantity": QUANTITIES})
    finest = rows[rows["nodes"].eq(rows["nodes"].max())].assign(error=lambda finest: finest["error"].abs())
    return finest.assign(excluded=finest["error"] > COVER * finest["uncertainty"])


def _pressed(report: Report) -> Iterator[dict[str, Any]]:
    """Yield the answers of each entry of presses whose elasticity is asked for."""
    presses = report.tables.get("presses", pd.DataFrame(columns=["entry"]))
    for entry in dict.fromkeys(presses["entry"]):
        rows = tables.where(presses, entry=entry)
        predictions = tables.where(report.tables["press_predictions"], entry=entry)
        parts = [_part(tables.where(rows, part=part)) for part in dict.fromkeys(rows["part"])]
        yield {
            "key": entry,
            "name": spaced(entry),
            "parts": parts,
            "predicted": [
                _ways(predictions, way, words) for way, words in WAYS.items() if predictions["by"].eq(way).any()
            ],
        }


def _part(rows: pd.DataFrame) -> dict[str, Any]:
    """Return the law of a part, and its quantities with intervals."""
    reported = rows[rows["reported"].eq(True)]
    values = reported.set_index("quantity")
    ranged = values[values["low"].notna() & ~values.index.isin(["exponent_excess"])]
    excesses = rows[rows["quantity"].eq("exponent_excess")]
    return {
        "name": rows["part"].iloc[0],
        "law": spaced(str(reported["law"].iloc[0])),
        "young": values.loc["young_pa", ["low", "best", "high"]].tolist(),
        "unknown": [spaced(str(name)) for name, row in ranged.iterrows() if not row["known"]],
        "excess": [(spaced(str(row.law)), row.low, row.high) for row in excesses.itertuples()],
        "scatter": float(values.loc["place_scatter", "best"]),
    }


def _ways(predictions: pd.DataFrame, way: str, words: str) -> dict[str, Any]:
    """Return the median errors of the best law, of rivals and floors, where something is left out."""
    errors = predictions[predictions["by"].eq(way)].groupby("model", sort=False)["error_share"].median()
    laws = errors[~errors.index.isin(list(RIVALS))]
    return {
        "way": words,
        "law": spaced(str(laws.idxmin())),
        "error": laws.min(),
        "rivals": [(RIVALS[name], errors[name]) for name in RIVALS if name in errors and name not in FLOORS],
        "floors": [(RIVALS[name], errors[name]) for name in FLOORS if name in errors],
    }


def _relaxing(report: Report) -> Iterator[dict[str, Any]]:
    """Yield the answers of each entry of presses whose relaxation is asked for."""
    relaxation = report.tables.get("relaxation", pd.DataFrame(columns=["entry"]))
    for entry in dict.fromkeys(relaxation["entry"]):
        rows, errors, presses, trends = (
            tables.where(report.tables[f"relaxation{name}"], entry=entry)
            for name in ("", "_errors", "_presses", "_trends")
        )
        chosen = rows[rows["chosen"].eq(True)]
        model = f"{len(chosen)} branch{'es' if len(chosen) > 1 else ''}"
        own_fits = errors[errors["left_out"].eq(NOTHING)].assign(model=errors["model"].str.removeprefix(f"{OWN}: "))
        kinds = [kind for kind in dict.fromkeys(errors["left_out"]) if kind != NOTHING]
        yield {
            "key": entry,
            "name": spaced(entry),
            "presses": presses,
            "branches": chosen,
            "own": own_fits.groupby("model", sort=False)["error"].median(),
            "predicted": [_judged(errors, kind, model) for kind in kinds],
            "trends": trends.assign(over=trends["over"].map(TRENDS)),
        }


TRENDS = {"depth_m": "depth", "strain": "depth over thickness", "thickness_m": "thickness", "loading_s": "loading time"}


def _judged(errors: pd.DataFrame, kind: str, model: str) -> dict[str, Any]:
    """Return the median error of ``model`` where a ``kind`` of presses is left out, and those of its rivals."""
    medians = errors[errors["left_out"].eq(kind)].groupby("model", sort=False)["error"].median()
    rivals = [(name, medians[name]) for name in medians.index if name != model and name != SIBLINGS]
    order = {MEAN: 1, POWER: 2}
    return {
        "kind": kind,
        "error": medians[model],
        "rivals": sorted(rivals, key=lambda row: order.get(row[0], 0)),
        "floor": medians.get(SIBLINGS),
    }
