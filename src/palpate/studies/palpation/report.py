"""Report whether a finger feels the regions of bodies, and how deep they may lie."""

from typing import Any

import pandas as pd

from palpate.report import tables
from palpate.report.report import Report
from palpate.report.words import spaced
from palpate.studies.palpation.palpation import least_contrasts

TITLE = "Palpation"


def numbers(report: Report) -> dict[str, Any]:
    """Return what the template names."""
    table, limits = report.tables["palpation"], report.tables["palpation_limits"]
    ends = limits[limits["contrast"].isin([limits["contrast"].min(), limits["contrast"].max()])]
    return {
        "bodies": [_of_body(tables.where(table, body=body)) for body in tables.bodies(table)],
        "threshold": table["threshold"].iloc[0],
        "limits": [{"cover_mm": 1e3 * cover, "contrast": c} for cover, c in sorted(least_contrasts(limits).items())],
        "ball_mm": 2e3 * limits["ball_radius_m"].iloc[0],
        "products": ends.groupby("contrast")["products"].max().items(),
    }


def _of_body(rows: pd.DataFrame) -> dict[str, Any]:
    """Return how much stiffer the nearest place is, up to where the region is felt, and the spread without it."""
    felt = rows[rows["felt"].astype(bool)]
    softest = tables.where(rows, force_n=rows["force_n"].min())["depth_without_m"]
    return {
        "name": spaced(rows["body"].iloc[0]),
        "stiffer": tables.where(rows, cover_m=rows["cover_m"].min())["stiffer"].max(),
        "felt_mm": 1e3 * felt["cover_m"].max() if len(felt) else None,
        "spread": softest.max() / softest.min(),
    }
