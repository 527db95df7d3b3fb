"""Compute what the report says of models beside measured bodies: what each predicts, and what it cannot."""

from typing import Any

import pandas as pd

from palpate.report.report import Report
from palpate.report.words import spaced
from palpate.studies.measured.figures.models import named
from palpate.studies.measured.measure import MEASURED
from palpate.studies.measured.predict import GIVEN
from palpate.studies.measured.report_of_presses import pressed, relaxing

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
        "experiments": [_experiment(str(one), rows) for one, rows in table.groupby("experiment", sort=False)],
        "silent": silent.drop_duplicates(["experiment", "case", "model", "setting"]),
        "pressed": list(pressed(report)),
        "relaxing": list(relaxing(report)),
    }


def _experiment(key: str, rows: pd.DataFrame) -> dict[str, Any]:
    """Return the rows of one experiment by what they answer: predictions, locking, laws, creep, and damping."""
    rows = rows[rows["marker"].eq("all")].assign(case=rows["case"].map(spaced))
    every = rows[rows["error"].notna()]
    quantity, setting = every["quantity"], every["setting"]
    fitted = every["calibrated"].ne(GIVEN) & every["case"].ne(every["calibrated"].map(spaced))
    plain = setting.str.fullmatch(PLAIN)
    free = every[every["calibrated"].eq(GIVEN) & quantity.eq("sink_m") & plain]
    finest = every[fitted & quantity.eq("sink_m") & plain].sort_values("nodes", kind="stable")
    repeats = every.drop_duplicates(["case", "quantity"]).dropna(subset=["repeat"])
    return {
        "key": key,
        "predicted": _predicted(every[fitted & plain & every["model"].eq("fem_p2")]),
        "crept": every[setting.str.endswith(" creep") & quantity.eq("frequency_hz")],
        "branched": every[setting.str.contains(" prony ") & quantity.eq("creep_m")],
        "given": free[free["case"].isin(free["case"].head(1))],
        "finest": finest.drop_duplicates(["case", "model"], keep="last"),
        "laws": every[
            fitted & quantity.eq("sink_m") & every["model"].eq("fem_p2") & setting.str.fullmatch(OF_ONE_MESH)
        ],
        "stepped": every[quantity.eq("damping_ratio") & setting.str.contains("step_s=", regex=False)],
        "damped": every[
            quantity.eq("damping_ratio") & setting.str.contains("damping=", regex=False) & every["fitted"].eq(False)
        ],
        "repeats": repeats[repeats["quantity"].isin(QUANTITIES)].replace({"quantity": QUANTITIES}),
        "untested": rows[rows["measured"].isna() & rows["predicted"].notna()],
    }


def _predicted(rows: pd.DataFrame) -> pd.DataFrame:
    """Return how well quadratic elements on the finest mesh predict the cases that they were not fitted to."""
    rows = rows[rows["quantity"].isin(["sink_m", "frequency_hz"])].replace({"quantity": QUANTITIES})
    finest = rows[rows["nodes"].eq(rows["nodes"].max())].assign(error=lambda finest: finest["error"].abs())
    return finest.assign(excluded=finest["error"] > COVER * finest["uncertainty"])
