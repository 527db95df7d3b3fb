"""Interactive view of errors over the body: one method and one of its samples at a time."""

from pathlib import Path

import numpy as np
from matplotlib.colors import LogNorm

from palpate.benchmark.database import Database
from palpate.report import render, style, turnable
from palpate.studies.enrichment.figures import error_over_body
from palpate.studies.enrichment.figures.predictions import Prediction

RANKS = ("best", "median", "worst")
_START = 1  # the first method's median sample; its contact is visible in the chosen view


def write(database: Database, predictions: dict[str, Prediction], path: str | Path) -> None:
    """Write, for each of error_over_body.METHODS, its best, median and worst test sample, coloured by the error.

    The body is shown as fine FEM deforms it, on one logarithmic scale of three decades in % of the sample's peak.
    """
    methods = error_over_body.METHODS
    picks = [pick for method in methods for pick in error_over_body.ranked(database, predictions[method])]
    limits = error_over_body.limits([field for _, field, _, _ in picks])
    norm = LogNorm(*limits)
    rest = database.nodes_fine_surface
    positions = np.array([rest + moved for _, _, moved, _ in picks])
    first = error_over_body.camera(database, *picks[_START][::2])
    notes = [f"sample {i}: {error_over_body.percent(100 * error)} % of peak" for i, _, _, error in picks]
    turnable.write(
        turnable.Turnable(
            render.frame(first.axes, list(positions)),
            positions,
            database.triangles,
            turnable.shades(100 * np.array([field for _, field, _, _ in picks]), norm),
            len(database.triangles),
            turnable.legend("error [% of the sample's peak displacement]", norm, style.ERROR),
            {
                "choices": {
                    "method": [style.short(method).replace("\n", " ") for method in methods],
                    "test sample": list(RANKS),
                },
                "notes": notes,
                "start": _START,
            },
        ),
        path,
    )
