"""Tabulate what a model was found to do: a row a sample, and a row a setting."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from palpate.benchmark.accuracy import TruthErrors
from palpate.benchmark.judge import SIDES, Judge
from palpate.benchmark.model import Case
from palpate.benchmark.timing import said
from palpate.errors import NotConverged

ERRORS = list(TruthErrors._fields)
SPREAD = ["rmse_of_peak", "relative_l2", "patch_rms_of_peak", "patch_max_of_peak"]
"""The errors whose median and 95th percentile over the test samples are tabulated beside their means."""
CHOSEN_BY = ["rmse_of_peak", "patch_rms_of_peak"]
"""The errors that settings are chosen by, on validation samples."""
LABELS = ["scene", "body", "regime", "model", "setting"]
KIND = ["sees", "prepared", "law"]
OPERATOR = "operator_rmse_of_peak"
ESTIMATED = "estimated_of_peak"
"""The error that a model estimates of its own answer; empty of models that do not."""
COARSER = {"rms": "coarser_rmse_of_peak", "patch": "coarser_patch_rms_of_peak"}
"""The distance of an answer from that of quadratic elements one level coarser than the finest, by kind of error."""
SAMPLE_COLUMNS = [
    *LABELS, "split", "side", "sample", "contact", *ERRORS, OPERATOR, ESTIMATED, *COARSER.values(), "seconds",
    "failure",
]  # fmt: skip
SETTING_COLUMNS = [
    *LABELS, *KIND, "protocol", "split", "samples", "failures", *ERRORS, OPERATOR,
    *(f"{name}_{part}" for name in SPREAD for part in ("median", "p95")),
    *(f"validation_{name}" for name in CHOSEN_BY),
    "online_median_s", "online_p95_s", "offline_s", "memory_mb", "threads", "failure",
]  # fmt: skip


class Asked(NamedTuple):
    """The answers of a solver to each sample.

    errors : of its answers; None where it failed, and ``failures`` has its message, else ""
    operator : distance from the fine operator, as a share of the peak; NaN where that means nothing
    seconds : of every timed call of each sample; of one that failed, none
    estimated : the RMSE over peak that the solver estimates of its answer; None or NaN where it does not
    coarser : distances from the answer of coarser elements, as ``Judge.from_coarser``; None where nobody compared
    """

    errors: list[TruthErrors | None]
    operator: list[float]
    failures: list[str]
    seconds: list[list[float]]
    estimated: list[float] | None = None
    coarser: list[tuple[float, float]] | None = None

    @staticmethod
    def failed(failure: NotConverged, count: int) -> "Asked":
        """Return that none of ``count`` samples was answered."""
        return Asked([None] * count, [np.nan] * count, [said(failure)] * count, [[]] * count)


class Finding(NamedTuple):
    """The result of one setting; ``labels`` are the columns LABELS, ``kind`` those of KIND.

    more : the answers to ``judge.more``, which are rows of samples and no part of means
    """

    labels: dict[str, str]
    asked: Asked
    offline_s: float
    memory_mb: float
    kind: Mapping[str, str | bool]
    more: Asked | None = None


def labels_of(case: Case, model: str, setting: str) -> dict[str, str]:
    """Return the columns LABELS."""
    scene = f"{case.body.name}_{case.regime}"
    return {"scene": scene, "body": case.body.name, "regime": case.regime, "model": model, "setting": setting}


def found_rows(findings: list[Finding], judge: Judge) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Tabulate a row a sample and a row a setting; cells of errors and seconds are empty where nothing was answered."""
    samples: list[dict] = []
    for finding in findings:
        samples += _sample_rows(finding.labels, finding.asked, judge)
        if finding.more and judge.more:
            samples += _sample_rows(finding.labels, finding.more, judge.more)
    settings = [_setting_row(finding, judge) for finding in findings]
    return pd.DataFrame(samples, columns=SAMPLE_COLUMNS), pd.DataFrame(settings, columns=SETTING_COLUMNS)


def _sample_rows(labels: dict[str, str], asked: Asked, judge: Judge) -> list[dict]:
    rows = []
    for i, found in enumerate(asked.errors):
        row = {**labels, "split": judge.split, "side": judge.side[i], "sample": judge.numbers[i]}
        row |= {"contact": judge.samples.contact[i], "failure": asked.failures[i]}
        if found is not None:
            seconds = np.median(asked.seconds[i]) if asked.seconds[i] else np.nan
            row |= found._asdict() | {OPERATOR: asked.operator[i], "seconds": seconds}
            row |= {ESTIMATED: asked.estimated[i] if asked.estimated else np.nan}
            if asked.coarser:
                row |= dict(zip(COARSER.values(), asked.coarser[i], strict=True))
        rows.append(row)
    return rows


def _setting_row(finding: Finding, judge: Judge) -> dict:
    """Take means over the test samples that were answered, but the largest max_of_peak of any.

    Errors on validation samples are empty unless all of them were answered.
    """
    asked = finding.asked
    answers = pd.DataFrame([f if f is not None else [np.nan] * len(ERRORS) for f in asked.errors], columns=ERRORS)
    answers[OPERATOR] = asked.operator
    chooses, tests = (judge.side == side for side in SIDES)
    failures = np.array(asked.failures, dtype=object)
    row: dict[str, Any] = {**finding.labels, **finding.kind, "protocol": "live", "split": judge.split, "threads": 1}
    row |= {"samples": int(tests.sum()), "failures": int((failures[tests] != "").sum())}
    row |= {"failure": next(filter(None, asked.failures), "")}
    row |= {"offline_s": finding.offline_s, "memory_mb": finding.memory_mb}
    row |= {f"validation_{name}": answers.loc[chooses, name].mean(skipna=False) for name in CHOSEN_BY}
    if seconds := [s for calls in asked.seconds for s in calls]:
        row |= {"online_median_s": np.median(seconds), "online_p95_s": np.percentile(seconds, 95)}
    found = answers[tests]
    row |= found.mean().to_dict() | {"max_of_peak": found["max_of_peak"].max()}
    for name in SPREAD:
        row |= {f"{name}_median": found[name].median(), f"{name}_p95": found[name].quantile(0.95)}
    return row
