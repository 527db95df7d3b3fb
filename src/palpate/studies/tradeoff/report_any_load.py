"""Show what models answer that they were not prepared for: new places, two contacts, discs pushed to a depth."""

import pandas as pd

from palpate.benchmark.advice_other_loads import advise_any_load
from palpate.report import markup, tables
from palpate.report.material import Report
from palpate.report.model_looks import label
from palpate.report.number_format import percent
from palpate.report.words import listed
from palpate.studies.tradeoff.any_load_words import brief
from palpate.studies.tradeoff.general_loads import LOADS

LIMITS = (0.05, 0.01)
"""Largest errors [of the peak] that the table asks for."""


def any_load(report: Report) -> str:
    """Return the figure, what to take for each kind of load, who refuses what, and the table."""
    table = report.tables["any_load"]
    beyond = report.folded("beyond_design") if "beyond_design" in report.tables else ""
    return report.figure("any_load") + _taken(table) + _refusals(table) + report.folded("any_load") + beyond


def _taken(table: pd.DataFrame) -> str:
    rows = []
    for scene in tables.scenes(table):
        found = tables.where(table, scene=scene)
        for kind in [kind for kind in LOADS if kind in set(found["kind"])]:
            limits = {
                f"error of at most {percent(e)}": brief(advise_any_load(found, kind, max_error=e)) for e in LIMITS
            }
            rows.append({"scene": scene.replace("_", " "), "load": kind} | limits)
    return markup.table(
        pd.DataFrame(rows), "The fastest whose largest error stays below, its mean and largest error, and the time"
    )


def _refusals(table: pd.DataFrame) -> str:
    """Name what each model refuses, in its own words."""
    rows = []
    for name, found in table[table["refused"] > 0].groupby("model", sort=False):
        answered = table[(table["model"] == name) & (table["refused"] == 0)]
        never = [kind for kind in LOADS if kind in set(found["kind"]) - set(answered["kind"])]
        if never:
            said = found[found["kind"].isin(never)].drop_duplicates("kind")["failure"]
            what = "; ".join(dict.fromkeys(said.str.replace(r"^contact \d+", "the place", regex=True)))
            rows.append({"model": label(name, "default"), "refuses": listed(never), "in its words": what})
    return markup.table(pd.DataFrame(rows), "What models refuse") if rows else ""
