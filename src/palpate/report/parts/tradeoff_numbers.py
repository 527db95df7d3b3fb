"""The numbers that the captions and the headline about accuracy and time name, worked out from their tables."""

import pandas as pd

from palpate.evaluation.tradeoff.advice import NONE
from palpate.evaluation.tradeoff.advice_reasons import MARGIN, behind, mesh_error
from palpate.evaluation.tradeoff.bootstrap import TRUTH
from palpate.evaluation.tradeoff.equal_settings import CLOSE, EQUAL
from palpate.figures import tables
from palpate.figures.model_looks import label
from palpate.figures.number_format import each, percent


def numbers(all_tables: dict[str, pd.DataFrame]) -> dict[str, str]:
    """Every placeholder of these captions, as text."""
    settings, advice = all_tables["accuracy_vs_time"], all_tables["advice"]
    advice = advice[advice["scene"].isin(settings["scene"])]  # scenes that move have a part of their own
    models = settings[settings["model"] != TRUTH]
    return {
        "headline_tradeoff": _headline(advice),
        "tradeoff_models": str(models["model"].nunique()),
        "tradeoff_settings": f"{len(models):,}",
        "tradeoff_failures": _failures(models),
        "tradeoff_truth": _truth(settings),
        "close": f"{CLOSE:g}",
        "equal": f"{EQUAL:g}",
        "spare": percent(MARGIN),
        "factors": each(tables.scenes(advice), lambda scene: _factors(tables.where(advice, scene=scene))),
    }


def _headline(advice) -> str:
    """What is advised within each budget, and how wrong it is, over the scenes."""
    parts = []
    for budget, rows in advice.groupby("budget_ms"):
        models = "; ".join(_share(model, found, len(rows)) for model, found in rows.groupby("model", sort=False))
        parts.append(f"within {budget:g}\u00a0ms {models}")
    text = ". ".join(f"{part[:1].upper()}{part[1:]}" for part in parts)
    return f"{text}." if text else "No budget of time was asked about."


def _share(model: str, rows, scenes: int) -> str:
    """One model's part of the scenes, and its errors there."""
    where = f"{len(rows)} of {scenes} scenes"
    if model == NONE:
        return f"none fits ({where})"
    low, high = percent(rows["rmse_of_peak"].min()), percent(rows["rmse_of_peak"].max())
    return f"{label(model, 'default')} ({where}, {low if low == high else f'{low} to {high}'} of the peak off)"


def _failures(models) -> str:
    failed = models[models["failures"] > 0]
    if failed.empty:
        return "none failed on any sample"
    return f"{len(failed)} failed on at least one sample and are named below each diagram"


def _truth(settings) -> str:
    """The error of the fine mesh itself, a phrase a scene."""
    own = {scene: mesh_error(tables.where(settings, scene=scene)) for scene in tables.scenes(settings)}
    told = [f"{scene.replace('_', ' ')} {percent(error)}" for scene, error in own.items() if error == error]
    return "; ".join(told) or "not measured"


def _factors(advice) -> str:
    """How far the next best model is behind the advised one within each budget."""
    rows = advice.dropna(subset=["budget_ms", "factor"]).itertuples()
    told = [
        f"within {row.budget_ms:g}\u00a0ms {label(row.rival, 'default')} is {behind(row.factor, EQUAL, 'wrong')}"
        for row in rows
    ]
    return ", ".join(told) or "nothing to compare"
