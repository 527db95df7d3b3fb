"""Compute what the report says of touches beside their tables: names, and what to take within each time."""

from typing import Any

import pandas as pd

from palpate.benchmark.advice import choice, touches
from palpate.benchmark.choosing import NONE, Limit
from palpate.report import tables
from palpate.report.model_looks import look
from palpate.report.report import Report
from palpate.report.words import seconds
from palpate.report.work_precision import FRAMES_MS
from palpate.studies.touch.figures import FELT, curve_of, named, title_of

READS = ("touch",)
"""Tables of benchmark/ that the template shows."""
SHARES = {
    "force [%]": "force_error",
    "limit [%]": "limit",
    "surface [% of peak]": "rmse_of_peak",
    "dent [% of peak]": "patch_rms_of_peak",
}
"""What is told of a setting that is taken, in per cent."""


def numbers(report: Report) -> dict[str, Any]:
    """Return what the template names beside its tables."""
    touch, truth = report.tables["touch"], report.tables["touch_truth"]
    titles = {str(scene): title_of(rows) for scene, rows in truth.groupby("scene", sort=False)}
    return {
        "touch": touch.assign(words=[named(row.model, row.setting) for row in touch.itertuples()]),
        "titles": titles,
        "felt": FELT,
        "taken": {scene: _taken(tables.where(touch, scene=scene)) for scene in titles},
        "touch_truth": truth.assign(title=truth["scene"].map(titles)),
    }


def _taken(touch: pd.DataFrame) -> pd.DataFrame:
    """Tabulate what is nearest to the true force within each time."""
    rows = []
    for limit in (*map(Limit, FRAMES_MS), Limit()):
        row: dict[str, Any] = {"within": f"{limit.budget_ms:g}\u00a0ms" if limit.time else "any time"}
        found = choice(touches(touch), limit)
        if found["model"] == NONE:
            near = f"fastest: {seconds(found['nearest_s'])}" if found["nearest_s"] > 0 else found["why"]
            row |= {"take": NONE, "setting": near}
        else:
            took = found["preparation_s"]
            row |= {"take": look(curve_of(found["model"], found["setting"])).label, "setting": found["setting"]}
            row |= {name: 100 * found[column] for name, column in SHARES.items()}
            row |= {"median": seconds(found["online_median_s"]), "slowest touch": seconds(found["online_max_s"])}
            row |= {"place prepared in": seconds(took) if took > 1e-4 else "–"}
        rows.append(row)
    names = dict.fromkeys(name for row in rows for name in row)
    return pd.DataFrame([{name: row.get(name, "–") for name in names} for row in rows])
