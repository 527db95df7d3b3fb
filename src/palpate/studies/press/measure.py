"""Choose presses whose truth is known, and measure the models of the page on which a body is pressed."""

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd

from palpate.benchmark.accuracy import errors
from palpate.benchmark.presses import samples_in
from palpate.benchmark.timing import online, time_calls
from palpate.benchmark.truth import OWN, Truth
from palpate.bodies.body import Body
from palpate.bodies.contacts import kept_contacts, spread_over
from palpate.press.page.page import Known
from palpate.stores import stored
from palpate.table_declaration import Table

PRESS = Table(
    "press",
    "The models that answer in this page: their errors on presses whose truth was simulated, and their time.",
    """
    body model contacts samples: what answers, contacts that are prepared, presses with a truth
    rmse_of_peak rmse_of_peak_most: median and largest error [peak]
    error_of_peak doubted: the error that the model states itself, and how many answers it doubts
    online_median_s online_p95_s file_mb: time of an answer in Python [s], and size of the file [1e6 bytes]
    """,
)


def place_of(body: Body, node: int) -> dict:
    """Return the place of a fine surface node: the number of a triangle, and the weights (3,) of its corners."""
    triangle = int(np.flatnonzero((body.fine.triangles == node).any(axis=1))[0])
    return {"triangle": triangle, "weights": (body.fine.triangles[triangle] == node).astype(float).tolist()}


def known_presses(body: Body, truths: Sequence[Path | str], loads: Sequence[Path | str], count: int) -> list[Known]:
    """Return at most ``count`` believed presses, the hardest of each contact, at contacts well spread over the body.

    truths, loads : files of the same regimes, truth.h5 and loads.csv
    """
    found: dict[int, Known] = {}
    for truth_file, load_file in zip(truths, loads, strict=True):
        truth, asked = stored(Truth, truth_file), {each.number: each for each in samples_in(pd.read_csv(load_file))}
        for i in np.flatnonzero(truth.believed):
            contact, force = asked[truth.sample[i]].load.single()
            if contact in found and np.linalg.norm(found[contact].force) >= np.linalg.norm(force):
                continue
            own = float(truth.own[i, OWN.index("rmse_of_peak")])
            found[contact] = Known(contact, place_of(body, contact), force, truth.displacement[i], own)
    rows = spread_over(body.fine.nodes[list(found)], count) if found else []
    return [list(found.values())[row] for row in rows]


def trial_presses(body: Body, count: int, depth_m: float) -> list[dict]:
    """Return straight presses to ``depth_m`` [m] at ``count`` contacts, where no truth is known."""
    contacts = kept_contacts(body, count)
    return [place_of(body, int(node)) | {"moved": (-depth_m * body.fine.normals[node]).tolist()} for node in contacts]


CALLS = 40
"""Answers that are timed."""


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
        seconds = time_calls([partial(model.respond, each) for each in presses], CALLS).seconds
        row = {"body": body, "model": name, "contacts": contacts, "samples": len(known)}
        row |= {"rmse_of_peak": _median(found), "rmse_of_peak_most": max(found, default=np.nan)}
        row |= {"error_of_peak": _median(told), "doubted": sum(bool(answer.doubt) for answer in answers)}
        rows.append(row | online(seconds) | {"file_mb": files_mb[name]})
    return PRESS.frame(rows)


def _median(values: Sequence[float]) -> float:
    return float(np.median(values)) if len(values) else float("nan")
