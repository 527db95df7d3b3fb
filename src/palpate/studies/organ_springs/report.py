"""Report on paper 2's chain for an organ: its masses, its fitted springs, and how good they are elsewhere."""

from typing import Any

import pandas as pd

from palpate.report import tables
from palpate.report.report import Report
from palpate.report.words import percent, seconds, spaced
from palpate.studies.organ_springs.figures import LOOKS

TITLE = "Paper 2: springs of an organ"
SEARCHES = ("genetic", "cma_es", "gradient")


def numbers(report: Report) -> dict[str, Any]:
    """Return what the template names."""
    springs, masses = report.tables["organ_springs"], report.tables["mass_motion"]
    counts = springs.groupby("used_in_fit")["contact"].nunique()
    return {
        "bodies": [
            _of_body(rows, tables.where(masses, body=body)) for body, rows in springs.groupby("body", sort=False)
        ],
        "fitted": int(counts[True]),
        "tested": int(counts[False]),
        "models": _tabulated(springs),
    }


def means(springs: pd.DataFrame) -> pd.DataFrame:
    """Return of each model and step the mean errors ``fitted`` and ``tested``, and the median time, by model.

    Errors are medians over the seeds of a search; ``low``, ``high`` are the range of ``tested`` over so many ``seeds``.
    """
    setting = ["model", "volume_force", "step_s"]
    found = springs.groupby(setting, sort=False)[["ms_a_second", "offline_s"]].median()
    for name, used in (("fitted", True), ("tested", False)):
        part = tables.where(springs, used_in_fit=used).groupby([*setting, "seed"], sort=False)
        means = part["rmse_of_peak"].mean().groupby(setting, sort=False)
        found[name] = means.median()
    return found.assign(low=means.min(), high=means.max(), seeds=means.size()).reset_index()


def best(springs: pd.DataFrame) -> pd.DataFrame:
    """Return of each model the row of ``means`` with the least error at tested contacts, indexed by model."""
    found = means(springs)
    return found.loc[found.groupby("model", sort=False)["tested"].idxmin()].set_index("model")


def _of_body(springs: pd.DataFrame, masses: pd.DataFrame) -> dict[str, Any]:
    """Return the errors of one body's models, what the reference misses, and what its masses change."""
    found, own_error = best(springs), springs.drop_duplicates("contact")["reference_error"]
    times = springs.groupby(["model", "step_s"])["ms_a_second"].median().groupby("model").min()
    return {
        "name": spaced(str(springs["body"].iloc[0])),
        "searches": {LOOKS[name].label: found.loc[name, "tested"] for name in SEARCHES if name in found.index},
        "fem": found.loc["coarse_fem", "tested"],
        "shapes": found.loc["shape_matching", "tested"],
        "zero": found.loc["zero", "tested"],
        "times_ms": [times[name] for name in ("genetic", "shape_matching", "coarse_fem")],
        "reference": (own_error.min(), own_error.max()),
        **_worst(springs),
        "masses": _masses(masses),
    }


def _worst(springs: pd.DataFrame) -> dict[str, Any]:
    """Return the errors at the one fitted contact where springs without a search are worst, and at the others."""
    fitted = tables.where(springs, used_in_fit=True)
    names = [name for name in ("van_gelder", *SEARCHES) if name in set(fitted["model"])]
    errors = fitted[fitted["model"].isin(names)].pivot_table("rmse_of_peak", "contact", "model", aggfunc="median")
    worst = errors["van_gelder"].idxmax()
    others = errors.drop(index=worst).mean()
    rows = [(LOOKS[name].label, errors.loc[worst, name], others[name]) for name in names]
    return {"worst": worst, "gains": rows, "others": bool(others.notna().all())}


def _masses(masses: pd.DataFrame) -> dict[str, Any] | None:
    """Return what uniform masses change, or None without a CT."""
    if not masses["from_ct"].astype(bool).any():
        return None
    return {name: tables.where(masses, masses=name).iloc[0] for name in ("own", "uniform", "mean")}


def _tabulated(springs: pd.DataFrame) -> pd.DataFrame:
    return pd.DataFrame(
        {
            "body": body,
            "model": LOOKS[row.model].label + (" and volume force" if row.volume_force else ""),
            "step [ms]": f"{1e3 * row.step_s:.3g}",
            "search": seconds(row.offline_s) if row.offline_s else "",
            "ms a second": "" if row.model == "zero" else f"{row.ms_a_second:.3g}",
            "fitted contacts": percent(row.fitted),
            "other contacts": percent(row.tested),
            "seeds": f"{row.seeds}: {percent(row.low)} to {percent(row.high)}" if row.seeds > 1 else "",
        }
        for body, found in springs.groupby("body", sort=False)
        for row in means(found).itertuples()
    )
