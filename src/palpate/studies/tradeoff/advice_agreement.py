"""Tabulate how far advice can be trusted: how often splits agree, and where it flips with the finger's radius."""

from collections.abc import Iterable, Mapping
from typing import Any

import pandas as pd

from palpate.benchmark.comparison import KINDS
from palpate.studies.tradeoff.advice import NONE

AGREEMENT_COLUMNS = [
    "scene", "body", "regime", "error", "budget_ms", "max_error", "model", "setting", "splits", "same", "same_setting",
    "others", "rmse_of_peak", "patch_rms_of_peak", "least", "most",
]  # fmt: skip
RADIUS_COLUMNS = [
    "body", "error", "split", "budget_ms", "max_error", "radius_m", "model", "setting", "rmse_of_peak",
    "patch_rms_of_peak", "flips",
]  # fmt: skip
_QUESTION = ["scene", "error", "budget_ms", "max_error"]


def agreement(advice: pd.DataFrame, scenes: Mapping[str, tuple[str, str]]) -> pd.DataFrame:
    """Tabulate advice_agreement.csv, a row for each scene, kind of error and question.

    advice : of advice.csv; scenes : body and regime of each scene, others (which move) are left out
    model : the one that most splits advise, of equally many the first; setting : its most frequent one
    splits, same, same_setting : how many splits there are, advise that model, and advise it with that setting
    others : the other models, with how many splits advise them
    rmse_of_peak, patch_rms_of_peak : means over the splits that advise it; least, most : of the error of that kind
    """
    rows = []
    for (scene, kind, budget, limit), asked in _by(advice[advice["scene"].isin(scenes)], _QUESTION):
        counts = asked["model"].value_counts(sort=False)
        model = counts.idxmax()
        own = asked[asked["model"] == model]
        settings = own["setting"].fillna("").value_counts(sort=False)
        body, regime = scenes[scene]
        row = {"scene": scene, "body": body, "regime": regime, "error": kind, "budget_ms": budget, "max_error": limit}
        row |= {"model": model, "setting": settings.idxmax(), "splits": len(asked), "same": counts[model]}
        row |= {"same_setting": settings.max(), "least": own[KINDS[kind]].min(), "most": own[KINDS[kind]].max()}
        row |= {"others": ", ".join(f"{name} {count}" for name, count in counts.drop(model).items())}
        rows.append(row | own[list(KINDS.values())].mean().to_dict())
    return pd.DataFrame(rows, columns=AGREEMENT_COLUMNS)


def by_radius(advice: pd.DataFrame, radii: Mapping[str, tuple[str, float]]) -> pd.DataFrame:
    """Tabulate advice_by_radius.csv: what is advised for each radius of the finger, the smallest first.

    advice : of advice.csv; radii : body and radius [m] of the scenes that are to be compared, others are left out
    flips : whether it is another model than that for the radius before, of the same body, error, split and question
    """
    there = advice[advice["scene"].isin(radii)].copy()
    there["body"] = [radii[scene][0] for scene in there["scene"]]
    there["radius_m"] = [radii[scene][1] for scene in there["scene"]]
    found = []
    for _, asked in _by(there, ["body", "error", "split", "budget_ms", "max_error"]):
        rows = asked.sort_values("radius_m", kind="stable")
        before = rows["model"].shift().fillna(rows["model"].iloc[0])
        found.append(rows.assign(flips=rows["model"] != before))
    return pd.concat(found)[RADIUS_COLUMNS] if found else pd.DataFrame(columns=RADIUS_COLUMNS)


def _by(advice: pd.DataFrame, columns: list[str]) -> Iterable[tuple[Any, pd.DataFrame]]:
    """Group by ``columns`` in the order of the table; of a budget and a largest error one is empty."""
    return advice.groupby(columns, sort=False, dropna=False)


def same_in(advice: pd.DataFrame) -> tuple[int, int]:
    """Return in how many splits the first row's model is advised, and how many there are, for one question."""
    return int((advice["model"] == advice["model"].iloc[0]).sum()), len(advice)


def agreed(agreement: pd.DataFrame) -> tuple[float, float, int]:
    """Return how often splits agree on a model: the mean share of splits, the share of questions in which all do.

    agreement : of advice_agreement.csv; questions that most splits answer with "none" are left out, as no model is
    advised there, and the number of the others is the third that is returned
    """
    answered = agreement[agreement["model"] != NONE]
    share = answered["same"] / answered["splits"]
    return float(share.mean()), float((share == 1).mean()), len(answered)
