"""Compose the models of the page on which a body is pressed, from what was measured of them."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from palpate.bodies.body import Body
from palpate.press.page.page import PressModel, PressTruth
from palpate.report.number_format import percent, seconds
from palpate.studies.press.known_presses import Known

TITLES = {"contact_modes": "contact modes", "coarse": "linear, coarse mesh"}
"""The models' names on the page."""
ABOUT = {
    "contact_modes": "Quadratic elements, reduced to shapes of presses.",
    "coarse": "Linear elements of the coarse mesh under small strains, as in a game.",
}


def press_models(
    table: pd.DataFrame, paths: Mapping[str, Path], known: Sequence[Known], info: Mapping
) -> list[PressModel]:
    """Return the models of ``table``, as ``measure`` made it, with their files, what is known of them, and truths.

    info : the header of the portable model, whose peak scales the colours
    """
    truths = [_truth(one) for one in known]
    portable = {key: info[key] for key in ("peak_m", "hardest_n")}
    found = []
    for row in table.itertuples():
        kind, more = ("coarse", portable) if row.model == "coarse" else ("portable", {})
        file = paths[row.model].read_bytes()
        advice = f"{ABOUT[row.model]} {worth(row)}"
        found.append(PressModel(row.model, TITLES[row.model], file, advice=advice, truths=truths, info=more, kind=kind))
    return found


def held_nodes(body: Body) -> np.ndarray:
    """Return (n,), whether each node of the fine surface is held."""
    return np.isin(body.fine.surface, body.anchors[-1])


def worth(row) -> str:
    """Return error and time of a row of the table press as a sentence."""
    time = f"an answer takes {seconds(row.online_median_s)} in Python"
    if not row.samples:
        return f"Here {time}."
    of = f"{row.samples} presses whose truth was simulated"
    error = f"Error {percent(row.rmse_of_peak)} of the peak, {percent(row.rmse_of_peak_most)} at most, on {of}"
    return f"{error}; {time}."


def _truth(one: Known) -> PressTruth:
    newtons, peak = float(np.linalg.norm(one.force)), float(np.linalg.norm(one.displacement, axis=1).max())
    note = f"The truth is the limit of ever finer quadratic elements; its own error is {percent(one.own)} of its peak."
    title = f"place {one.contact}: {newtons:.2g} N, moves {1e3 * peak:.0f} mm"
    return PressTruth(title, one.place["triangle"], one.place["weights"], list(one.force), one.displacement, note)
