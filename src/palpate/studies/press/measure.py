"""Prepare the models of the page on which a body is pressed, and measure them on presses whose truth is known."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from palpate.benchmark.accuracy import OWN, Truth, errors
from palpate.benchmark.measuring import online, time_calls
from palpate.benchmark.model import Case
from palpate.benchmark.presses import samples_in
from palpate.bodies.body import Body
from palpate.bodies.body_file import load
from palpate.bodies.contacts import kept_contacts, spread_over
from palpate.effects.instrument import Instrument
from palpate.models.kinds import ContactModes
from palpate.press.coarse_rival import coarse_answer, packed
from palpate.press.page.page import Known, held_nodes, model_in_page, write_pages
from palpate.press.portable.file import read
from palpate.run.job import steps
from palpate.stores import stored
from palpate.studies.press.settings import Settings
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
    """Return a node of the fine surface as a point of a triangle: its number, and the weights (3,) of its corners."""
    triangle = int(np.flatnonzero((body.fine.triangles == node).any(axis=1))[0])
    return {"triangle": triangle, "weights": (body.fine.triangles[triangle] == node).astype(float).tolist()}


def known_presses(body: Body, truths: Sequence[Path | str], loads: Sequence[Path | str], count: int) -> list[Known]:
    """Return at most ``count`` presses whose truth is believed: the hardest of each contact, spread over the body.

    truths, loads : files truth.h5 and loads.csv of the same regimes
    """
    hardest: dict[int, Known] = {}
    for truth_file, load_file in zip(truths, loads, strict=True):
        truth, samples = stored(Truth, truth_file), {each.number: each for each in samples_in(pd.read_csv(load_file))}
        for i in np.flatnonzero(truth.believed):
            contact, force = samples[truth.sample[i]].load.single()
            if contact in hardest and np.linalg.norm(hardest[contact].force) >= np.linalg.norm(force):
                continue
            own_error = float(truth.own[i, OWN.index("rmse_of_peak")])
            hardest[contact] = Known(contact, place_of(body, contact), force, truth.displacement[i], own_error)
    rows = spread_over(body.fine.nodes[list(hardest)], count) if hardest else []
    return [list(hardest.values())[row] for row in rows]


def trial_presses(body: Body, count: int, depth_m: float) -> list[dict]:
    """Return straight presses to ``depth_m`` [m] at ``count`` contacts, where no truth is known."""
    contacts = kept_contacts(body, count)
    return [place_of(body, int(node)) | {"moved": (-depth_m * body.fine.normals[node]).tolist()} for node in contacts]


CALLS = 40
"""Answers that are timed."""


def measure(
    body: str, models: Mapping[str, tuple], known: Sequence[Known], trials: Sequence[Mapping], files_mb: Mapping
) -> pd.DataFrame:
    """Measure the rows of PRESS of a body, one for each of ``models``.

    models : by name, the number of contacts that a model was prepared for, and the model, with ``respond(presses)``
    known : presses whose truth is known; trials : presses that are timed where none is known
    files_mb : size of each model's file [1e6 bytes]
    """
    rows = []
    presses = [[press_case.press] for press_case in known] or [[dict(press_case)] for press_case in trials]
    for name, (contacts, model) in models.items():
        answers = [model.respond(each) for each in presses]
        relative_errors = [
            errors(np.asarray(answer.displacement, float), press_case.displacement).rmse_of_peak
            for answer, press_case in zip(answers, known, strict=False)
        ]
        estimates = [answer.error for answer in answers if answer.error is not None and np.isfinite(answer.error)]
        seconds = time_calls([partial(model.respond, each) for each in presses], CALLS).seconds
        row = {"body": body, "model": name, "contacts": contacts, "samples": len(known)}
        row |= {"rmse_of_peak": _median(relative_errors), "rmse_of_peak_most": max(relative_errors, default=np.nan)}
        row |= {"error_of_peak": _median(estimates), "doubted": sum(bool(answer.doubt) for answer in answers)}
        rows.append(row | online(seconds) | {"file_mb": files_mb[name]})
    return PRESS.frame(rows)


def _median(values: Sequence[float]) -> float:
    return float(np.median(values)) if len(values) else float("nan")


def export_model(
    input: Any, output: Any, say: Callable, settings: Settings, radius_m: float, seed: int, tolerance: float
) -> None:
    """Prepare contact modes of a body for its page, for the rule of this name."""
    from palpate.press.portable import export
    from palpate.press.portable.touches import Touches

    body = load(input.body)
    case = Case.untrained(body, "press", radius_m, seed, tolerance)
    model = ContactModes(modes=settings.modes, thinned=settings.thinned, target="limit")
    instruments = [Instrument(**dict(each)) for each in settings.instruments]
    touches = Touches(instruments, settings.places) if instruments else None

    def progress(what: str) -> Callable:
        return steps(say, f"{body.name}: {what}")

    export.export_model(case, model, settings.contacts, output.model, progress, touches)


def write_press(input: Any, output: Any, contacts: int, samples: int, radius_m: float) -> dict[str, pd.DataFrame]:
    """Measure the models of a body's page, and write the page, for the rule of this name."""
    body, model = load(input.body), read(input.model)
    presses = known_presses(body, input.truths, input.loads, samples)
    trials = trial_presses(body, contacts, 0.5 * model.info["peak_m"])
    models: dict[str, tuple] = {"contact_modes": (contacts, model)}
    file_bytes = {"contact_modes": Path(input.model).read_bytes()}
    if (coarse := coarse_answer(body, radius_m)) is not None:
        models["coarse"], file_bytes["coarse"] = (0, coarse), packed(coarse)
    table = measure(body.name, models, presses, trials, {name: len(file) / 1e6 for name, file in file_bytes.items()})
    shown = [model_in_page(row.model, file_bytes[row.model], model.info, row, presses) for row in table.itertuples()]
    write_pages(shown, body.name, held_nodes(body), output.section, output.page)
    return {"table": table}
