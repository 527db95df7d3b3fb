"""Identify tissue from the presses of one entry of the config, and test it on presses that were left out."""

import os
import warnings
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from palpate.bodies import body_file
from palpate.bodies.body import Body
from palpate.identification.asked import Asked, identify_and_predict, table_rows
from palpate.identification.fit import Options
from palpate.identification.identify import Identified
from palpate.identification.presses import PressRecords, doubts
from palpate.identification.progress import Progress
from palpate.identification.relaxation import without_time
from palpate.identification.sessions import compare_sessions, consistent_parts
from palpate.run.job import steps
from palpate.studies.measured import relaxed
from palpate.studies.measured.records import presses_of
from palpate.studies.measured.settings import Presses
from palpate.table_declaration import Table

PRESSES = Table(
    "presses",
    "What presses determine, with intervals of 90 %.",
    """
    entry part: an entry, and the session and specimen that were fitted
    law reported: the law, and whether it is the one that fits best
    quantity unit: a parameter, E, a scatter, or the exponent of depth that presses have and the law lacks
    low best high: the interval, by profile likelihood
    known: whether the presses say more than the range did
    open_low open_high: whether an end is that of the range
    resampled_low resampled_high: the interval by drawing places with replacement
    """,
    always=False,
)
PRESS_PREDICTIONS = Table(
    "press_predictions",
    "Error of forces of presses that a model did not see, by what was left out.",
    """
    entry part: an entry, and the session and specimen that were fitted
    by: what was left out: place, depth (beyond half of the largest), session or specimen
    model: a law; line and power_law, fitted alike to all or to one press (_of_place); repeat, neighbour: the floor
    press: its name
    error_share: root of the mean square error of its forces that were left out, over that of the forces
    bias_share: mean error over the mean force; positive where the prediction is too large
    """,
    always=False,
)
PRESS_CURVES = Table(
    "press_curves",
    "Forces of presses as measured and as fitted with the effects of their places.",
    """
    entry part press session: a press, and what was fitted
    x_m y_m: its place, seen along the mean direction of the presses
    depth_m measured_n fitted_n: depth since first touch, force, and that of the reported law
    low_n high_n: nine tenths of forces are within, by the errors of single points
    """,
    always=False,
)
ELASTIC, RELAXATION = "elastic", "relaxation"


def identify_presses(
    input: Any, output: Any, wildcards: Any, say: Callable, entry: Presses, seed: int
) -> dict[str, pd.DataFrame]:
    """Identify elasticity and relaxation, as an entry asks for them, for the rule of this name."""
    name, records = wildcards.presses, presses_of(entry)
    for doubt in (*records.found, *doubts(records)):
        warnings.warn(f"measured.presses.{name}: {doubt}", stacklevel=2)
    tables = {table.name: table.frame([]) for table in (PRESSES, PRESS_PREDICTIONS, PRESS_CURVES, *relaxed.TABLES)}
    if RELAXATION in entry.ask:
        relaxing, kernel = relaxed.identify_relaxation(name, records, entry, seed, steps(say, f"{name}: left out"))
        tables |= relaxing
        records = without_time(records, kernel)
    if ELASTIC in entry.ask:
        body = body_file.load(input.body[0]) if input.body else None
        tables |= _elastic(name, records, entry, body, seed, Path(output.presses).parent, say)
    return tables


def _elastic(
    name: str, records: PressRecords, entry: Presses, body: Body | None, seed: int, folder: Path, say: Callable
) -> dict:
    """Return the tables of the elasticity that forces over depth determine, for each part whose sessions agree."""
    assert records.instrument is not None  # as the settings check
    thickness = (entry.thickness_m[0], entry.thickness_m[1]) if entry.thickness_m else None
    poisson, sticking = ((low, high) for low, high in (entry.poisson, entry.sticking))
    asked = Asked(records.instrument, body, thickness, poisson, sticking, laws=entry.laws)
    rows: list = []
    predicted, curves = [], []
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        progress = Progress(lambda what, sequence: steps(say, f"{name}: {what}")(sequence), pool.map)
        for part, consistent in consistent_parts(records, compare_sessions(records)):
            arguments = asked, Options(seed=seed), entry.held_out, folder / "curves", progress
            identified, errors = identify_and_predict(consistent, *arguments)
            rows += [[name, *row] for row in table_rows(identified, part)]
            predicted.append(errors.assign(entry=name, part=part))
            curves.append(_curves(identified).assign(entry=name, part=part))
    return {
        PRESSES.name: PRESSES.frame(rows),
        PRESS_PREDICTIONS.name: pd.concat(predicted)[PRESS_PREDICTIONS.columns],
        PRESS_CURVES.name: pd.concat(curves)[PRESS_CURVES.columns],
    }


NINE_TENTHS = 1.645
"""Half width of an interval that holds 90 % of a normal distribution, in standard deviations."""


def _curves(identified: Identified) -> pd.DataFrame:
    """Tabulate the measured and the fitted force over depth of each press, with the interval of single points."""
    presses = {press.name: press for press in identified.records.presses}
    flat = _in_plane([press.at_m for press in presses.values()], [press.direction for press in presses.values()])
    places = dict(zip(presses, flat, strict=True))
    parts = []
    for curve in identified.curves:
        band = NINE_TENTHS * np.hypot(
            identified.scatter["noise_share"] * curve.predicted_n, identified.scatter["noise_n"]
        )
        rows = {"depth_m": curve.depth_m, "measured_n": curve.force_n, "fitted_n": curve.predicted_n}
        rows |= {"low_n": curve.predicted_n - band, "high_n": curve.predicted_n + band}
        x, y = places[curve.name]
        parts.append(pd.DataFrame(rows).assign(press=curve.name, session=presses[curve.name].session, x_m=x, y_m=y))
    return pd.concat(parts)


def _in_plane(places: Sequence[np.ndarray | None], directions: Sequence[np.ndarray | None]) -> np.ndarray:
    """Project places onto the plane across the mean direction of presses: (n, 2) [m]; NaN if a place is unknown."""
    if any(place is None for place in places):
        return np.full((len(places), 2), np.nan)
    points = np.array(places)
    if any(direction is None for direction in directions):
        return points[:, :2]
    down = np.mean([direction for direction in directions if direction is not None], axis=0)
    down /= np.linalg.norm(down)
    across = np.eye(3)[np.abs(down).argmin()]
    across = across - (across @ down) * down
    across /= np.linalg.norm(across)
    return points @ np.column_stack([across, np.cross(across, down)])
