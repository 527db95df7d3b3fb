"""Compute the errors and times of an organ's springs, means over contacts and medians over seeds."""

from typing import Any

import pandas as pd

from palpate.report import tables
from palpate.report.model_looks import look
from palpate.report.report import Report
from palpate.report.words import percent, seconds

SEARCHES = ["genetic", "cma_es", "gradient"]


def numbers(report: Report) -> dict[str, Any]:
    """Return what the template names beside its tables."""
    springs = report.tables["organ_springs"]
    return {
        "best": [(body, best(rows)) for body, rows in springs.groupby("body", sort=False)],
        "searches": SEARCHES,
        "models": _tabulated(springs),
    }


def means(springs: pd.DataFrame) -> pd.DataFrame:
    """Return of each model and time step the mean errors at ``fitted`` and ``tested`` contacts, and the median times.

    Errors are medians over the seeds of a search; ``low``, ``high`` are the range of ``tested`` over so many ``seeds``.
    """
    setting = ["model", "volume_force", "step_s"]
    medians = springs.groupby(setting, sort=False)[["ms_a_second", "offline_s"]].median()
    for name, fitted in (("fitted", True), ("tested", False)):
        of_contacts = tables.where(springs, used_in_fit=fitted).groupby([*setting, "seed"], sort=False)
        of_seeds = of_contacts["rmse_of_peak"].mean().groupby(setting, sort=False)
        medians[name] = of_seeds.median()
    return medians.assign(low=of_seeds.min(), high=of_seeds.max(), seeds=of_seeds.size()).reset_index()


def best(springs: pd.DataFrame) -> pd.DataFrame:
    """Return of each model the row of ``means`` with the least error at tested contacts, indexed by model."""
    by_setting = means(springs)
    return by_setting.loc[by_setting.groupby("model", sort=False)["tested"].idxmin()].set_index("model")


def _tabulated(springs: pd.DataFrame) -> pd.DataFrame:
    return pd.DataFrame(
        {
            "body": body,
            "model": look(row.model).label + (" and volume force" if row.volume_force else ""),
            "step [ms]": f"{1e3 * row.step_s:.3g}",
            "search": seconds(row.offline_s) if row.offline_s else "",
            "ms a second": "" if row.model == "zero" else f"{row.ms_a_second:.3g}",
            "fitted contacts": percent(row.fitted),
            "other contacts": percent(row.tested),
            "seeds": f"{row.seeds}: {percent(row.low)} to {percent(row.high)}" if row.seeds > 1 else "",
        }
        for body, of_body in springs.groupby("body", sort=False)
        for row in means(of_body).itertuples()
    )
