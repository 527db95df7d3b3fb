"""The numbers that the captions and the headline of the scenes name, worked out from their tables."""

import numpy as np
import pandas as pd

from palpate.figures import tables
from palpate.figures.number_format import each, percent, seconds
from palpate.figures.scenes import energy


def numbers(all_tables: dict[str, pd.DataFrame], scenes: list[str]) -> dict[str, str]:
    """Every placeholder of the scenes' captions, as text; a phrase a scene where there are several."""
    effects, energies = all_tables["effects"], all_tables["energy"]

    def phrases(phrase, table):
        return each(scenes, lambda scene: phrase(tables.where(table, scene=scene)))

    return {
        "scene_count": str(len(scenes)),
        "headline_scenes": _headline(scenes, effects),
        "energy_growth": phrases(_growth, energies),
        "dearest": phrases(_dearest, effects),
        "missed": phrases(lambda rows: _missed(rows, most=True), effects),
        "unmissed": phrases(lambda rows: _missed(rows, most=False), effects),
    }


def _headline(scenes, effects) -> str:
    """What a step of each scene costs."""
    total = effects.groupby("scene")["ms_per_step"].sum()
    steps = each(scenes, lambda scene: f"{seconds(1e-3 * total[scene])} a step")
    return f"{len(scenes)} scenes, each made of the effects it calls for and of nothing else ({steps})."


def _growth(rows) -> str:
    """By how much the sum of energies minus the outer work ever rises above what it was before."""
    rows = energy.counted(rows)
    if not energy.whole(rows):
        return "not known, as its elastic effect has no energy"
    balance = rows["balance_j"].to_numpy()
    rise = float((balance - np.minimum.accumulate(balance)).max())
    parts = rows[[*energy.of_effects(rows), "balance_j"]].to_numpy()
    return percent(rise / (np.ptp(parts, axis=0).max() or 1.0))


def _dearest(rows) -> str:
    """What takes most of a step."""
    row = rows.loc[rows["ms_per_step"].idxmax()]
    return f"{_name(row)} takes {percent(row['share_of_step'])} of {seconds(1e-3 * rows['ms_per_step'].sum())}"


def _missed(rows, most: bool) -> str:
    """The effect without which a scene goes most, or least, wrong."""
    found = rows[np.isfinite(rows["error_if_left_out"])]
    if found.empty:
        return "nothing can be left out"
    errors = found["error_if_left_out"]
    row = found.loc[errors.idxmax() if most else errors.idxmin()]
    return f"{_name(row)} ({percent(row['error_if_left_out'])})"


def _name(row) -> str:
    """An effect's name inside a sentence."""
    return row["effect"].replace("_", " ")
