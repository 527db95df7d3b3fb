"""The part of the report on touches: what each model makes of what moves, and of what the hand feels."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd

from palpate.benchmark.advice import advise_touch
from palpate.benchmark.choosing import NONE
from palpate.report import tables
from palpate.report.model_looks import look
from palpate.report.report import Report
from palpate.report.words import percent, seconds
from palpate.studies.touch.figures import FELT, FRAMES_MS, answers, curve_of, named, title_of

TITLE = "What a hand feels"
OWN = {
    "rmse_of_peak": "surface [% of peak]",
    "patch_rms_of_peak": "dent [% of peak]",
    "force_error": "force [%]",
    "stiffness_error": "stiffness [%]",
    "area_error": "area [%]",
}
"""The truth's own errors, in words."""
SHARES = {
    "force [%]": "force_error",
    "limit [%]": "limit",
    "surface [% of peak]": "rmse_of_peak",
    "dent [% of peak]": "patch_rms_of_peak",
}
"""What is told of a setting that is taken, in per cent."""


def numbers(report: Report) -> dict[str, Any]:
    """Return what the template names."""
    touch, truth = report.tables["touch"], report.tables["touch_truth"]
    return {
        "scenes": [
            _of_scene(tables.where(touch, scene=scene), tables.where(truth, scene=scene))
            for scene in tables.scenes(truth)
        ],
        "felt": FELT,
        "truth_table": _truth(touch, truth),
    }


def _of_scene(touch: pd.DataFrame, truth: pd.DataFrame) -> dict[str, Any]:
    """Return what the template says of one instrument on one body."""
    known, models = truth.iloc[0], answers(touch)
    told = models[(models["failures"] == 0) & models["force_error_size"].notna()]
    close = told[told["force_error_size"] <= FELT[1]].sort_values("online_median_s")
    return {
        "scene": known["scene"],
        "words": title_of(truth),
        "samples": int(known["samples"]),
        "rejected": f"{known['rejected']} more have no truth ({known['why_rejected']})" if known["rejected"] else "",
        "depths": _between(1e3 * known[["depth_min_m", "depth_max_m"]], "mm"),
        "forces": _between(1e3 * known[["force_min_n", "force_max_n"]], "mN"),
        "known": _known(known) if known["samples"] else "no touch has a truth that is believed",
        "told": len(told),
        "settings": len(models),
        "close": len(close),
        "fastest": _answer(close.iloc[0]) if len(close) else "",
        "taken": _taken(touch),
    }


def _known(row: pd.Series) -> str:
    """Return how well the truth of a scene is known."""
    return f"the truth's force is known to {percent(row['force_error'])}, its surface to {percent(row['rmse_of_peak'])}"


def _between(ends: pd.Series, unit: str) -> str:
    """Return the least and the most of something, with two digits."""
    if not np.isfinite(ends.astype(float)).all():
        return "unknown"
    return " to ".join(dict.fromkeys(f"{float(f'{end:.2g}'):g}" for end in ends)) + f"\u00a0{unit}"


def _answer(row: pd.Series | dict[str, Any]) -> str:
    """Return a setting with its errors and time."""
    force, surface, dent = (percent(row[name]) for name in ("force_error_size", "rmse_of_peak", "patch_rms_of_peak"))
    time = seconds(row["online_median_s"])
    return f"{named(row['model'], row['setting'])} in {time} (force {force} off, surface {surface}, dent {dent})"


def _taken(touch: pd.DataFrame) -> pd.DataFrame:
    """Tabulate what is nearest to the true force within each time."""
    rows = []
    for budget in (*FRAMES_MS, None):
        row: dict[str, Any] = {"within": "any time" if budget is None else f"{budget:g}\u00a0ms"}
        found = advise_touch(touch, budget_ms=budget)
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


def _truth(touch: pd.DataFrame, truth: pd.DataFrame) -> pd.DataFrame:
    """Tabulate how well the truth of each instrument is known."""
    rows = []
    for _, row in truth.iterrows():
        shown = {"": title_of(tables.where(truth, scene=row["scene"])), "touches": row["samples"]}
        shown |= {"without a truth": row["rejected"]}
        for column, name in OWN.items():
            shown |= {name: f"{percent(row[column])} ({percent(row[f'{column}_max'])})" if row["samples"] else "–"}
        rows.append(shown | {"order": row["order"], "nodes": row["nodes"], "time": seconds(row["seconds"])})
    return pd.DataFrame(rows)


def failures(report: Report) -> Iterator[tuple[str, str, str]]:
    """Yield the settings that failed on some touches: what, where, how."""
    touch = report.tables["touch"]
    for row in touch[touch["failures"] > 0].itertuples():
        yield (
            named(row.model, row.setting),
            title_of(tables.where(touch, scene=row.scene)),
            (f"no answer to {row.failures} of {row.samples} touches: {row.failure}"),
        )
