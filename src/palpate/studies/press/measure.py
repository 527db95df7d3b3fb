"""Measure the models of the page on which a body is pressed: their error, what they say of it, and their time."""

from collections.abc import Mapping, Sequence
from time import perf_counter
from typing import Any

import numpy as np
import pandas as pd

from palpate.benchmark.accuracy import errors
from palpate.studies.press.known_presses import Known
from palpate.studies.press.tables import TABLES

CALLS = 40
"""Answers that are timed, after one that warms up."""


def measure(
    body: str, models: Mapping[str, tuple], known: Sequence[Known], trials: Sequence[Mapping], files_mb: Mapping
) -> pd.DataFrame:
    """Return a row for each of ``models``.

    models : by name, the number of contacts that each was prepared for, and what has ``respond(presses)``
    known : presses whose truth is known; trials : others, which are pressed where there are none
    """
    rows = []
    presses = [[one.press] for one in known] or [[dict(one)] for one in trials]
    for name, (contacts, model) in models.items():
        answers = [model.respond(each) for each in presses]
        found = [
            errors(np.asarray(answer.displacement, float), one.displacement).rmse_of_peak
            for answer, one in zip(answers, known, strict=False)
        ]
        told = [answer.error for answer in answers if answer.error is not None and np.isfinite(answer.error)]
        seconds = [_timed(model, presses[call % len(presses)]) for call in range(CALLS)]
        row = {"body": body, "model": name, "contacts": contacts, "samples": len(known)}
        row |= {"rmse_of_peak": _median(found), "rmse_of_peak_most": max(found, default=np.nan)}
        row |= {"error_of_peak": _median(told), "doubted": sum(bool(answer.doubt) for answer in answers)}
        row |= {"online_median_s": _median(seconds), "online_p95_s": float(np.percentile(seconds, 95))}
        rows.append(row | {"file_mb": files_mb[name]})
    return pd.DataFrame(rows, columns=TABLES["press"].columns.split())


def _timed(model: Any, presses: list[dict]) -> float:
    start = perf_counter()
    model.respond(presses)
    return perf_counter() - start


def _median(values: Sequence[float]) -> float:
    return float(np.median(values)) if len(values) else float("nan")
