"""Prepare the model of the page on which a body is pressed, from the body alone, and write it to its file."""

from collections.abc import Mapping
from pathlib import Path

from palpate.benchmark.model import Case
from palpate.bodies.body import Body
from palpate.press.portable.export import Progress, export_model

REGIME = "press"
"""The name of a regime that has no samples."""


def export(
    body: Body,
    settings: Mapping,
    radius_m: float,
    grid: Mapping,
    seed: int,
    tolerance: float,
    path: Path | str,
    progress: Progress,
) -> None:
    """Write contact modes of ``body`` for discs of ``radius_m`` [m] to ``path``.

    settings : ``contacts``, how many are prepared, ``modes`` and ``thinned``; grid, seed, tolerance : as of a Case
    """
    case = Case.untrained(body, REGIME, radius_m, seed, tolerance, grid)
    setting = {"modes": settings["modes"], "rings": grid["contact_modes"]["rings"][-1]}
    setting |= {"thinned": settings["thinned"], "target": "limit"}
    export_model(case, setting, settings["contacts"], path, progress)
