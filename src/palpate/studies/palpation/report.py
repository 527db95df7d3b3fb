"""Report whether a finger feels the regions of bodies, and how deep they may lie."""

import numpy as np
import pandas as pd

from palpate.report import tables
from palpate.report.material import Report, Section
from palpate.report.number_format import each, percent
from palpate.studies.palpation.palpation_limits import least_contrasts
from palpate.studies.palpation.tables import TABLES

__all__ = ["TABLES", "TITLE", "numbers", "sections"]

TITLE = "Palpation"


def numbers(report: Report) -> dict[str, str]:
    """Return every placeholder of these captions, as text; a phrase for each body where there are several."""
    table, limits = report.tables["palpation"], report.tables["palpation_limits"]
    bodies = tables.bodies(table)
    felt = each(bodies, lambda body: _felt(tables.where(table, body=body)))
    return {
        "headline": f"A finger on a body with a stiff region: {felt}; a ball in a slab is felt {_least(limits)}.",
        "palpation_felt": felt,
        "palpation_threshold": percent(table["threshold"].iloc[0]),
        "palpation_least": _least(limits),
        "palpation_ball": f"{2e3 * limits['ball_radius_m'].iloc[0]:g} mm",
        "palpation_spread": each(bodies, lambda body: _spread(tables.where(table, body=body))),
        "palpation_products": _products(limits),
    }


def _felt(rows: pd.DataFrame) -> str:
    """Return how much stiffer the nearest place is, and up to where the region is felt."""
    nearest = rows[rows["cover_m"] == rows["cover_m"].min()]["stiffer"].max()
    said = f"{percent(nearest)} stiffer right above it"
    felt = rows[rows["felt"].astype(bool)]
    return f"{said}, felt up to {1e3 * felt['cover_m'].max():.0f} mm from it" if len(felt) else f"{said}, not felt"


def _spread(rows: pd.DataFrame) -> str:
    """Return how many times as far the softest place gives way as the hardest, without the region."""
    least = rows[rows["force_n"] == rows["force_n"].min()]["depth_without_m"]
    return f"{least.max() / least.min():.1f} times"


def _least(limits: pd.DataFrame) -> str:
    """Return the least contrast that is felt at each depth."""
    found = least_contrasts(limits)
    parts = [
        f"{1e3 * cover:g} mm deep " + (f"from {contrast:.2g} times" if np.isfinite(contrast) else "at no contrast")
        for cover, contrast in sorted(found.items())
    ]
    return ", ".join(parts) + " its stiffness"


def _products(limits: pd.DataFrame) -> str:
    """Return the products with the stiffness matrix at the least and the largest contrast."""
    ends = limits[limits["contrast"].isin([limits["contrast"].min(), limits["contrast"].max()])]
    most = ends.groupby("contrast")["products"].max()
    return " and ".join(f"{count} at a contrast of {contrast:g}" for contrast, count in most.items())


def sections(report: Report) -> list[Section]:
    """Return what is felt on bodies, and the limits in a slab."""
    return [
        ("palpation_places", "Is it felt?", report.figure("palpation") + report.folded("palpation")),
        ("palpation_depths", "How deep", report.figure("palpation_limits") + report.folded("palpation_limits")),
    ]
