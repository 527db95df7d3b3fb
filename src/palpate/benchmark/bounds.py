"""Tabulate what no model can be better or should be worse than: the truth's own error, and the answer zero."""

import numpy as np
import pandas as pd

from palpate.benchmark.accuracy import TruthErrors
from palpate.benchmark.bootstrap import OWN_ERROR, TRUTH, ZERO
from palpate.benchmark.findings import Asked, Finding, found_rows, labels_of
from palpate.benchmark.judge import Judge
from palpate.benchmark.model import Case

UNPREPARED: dict[str, str | bool] = {"sees": "load", "prepared": False}


def bounds(case: Case, judge: Judge) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Tabulate the models "truth" and "zero" as ``measure_model.measure`` does: a row a sample, a row a setting.

    The time of the truth is that of its solutions on all levels; the answer zero has none.
    """
    count = len(judge.numbers)
    own: list[TruthErrors | None] = [TruthErrors(*map(float, each)) for each in judge.own]
    nothing: list[TruthErrors | None] = [judge.errors(i, np.zeros_like(truth)) for i, truth in enumerate(judge.truth)]
    taken = [[float(seconds)] for seconds in judge.own_seconds]
    rest = [np.nan] * count, [""] * count
    never: list[list[float]] = [[]] * count
    findings = [
        Finding(labels_of(case, model, setting), Asked(errors, *rest, seconds), 0.0, 0.0, UNPREPARED | {"law": law})
        for model, setting, errors, seconds, law in (
            (TRUTH, OWN_ERROR, own, taken, case.body.material.law),
            (ZERO, "default", nothing, never, ""),
        )
    ]
    return found_rows(findings, judge)
