"""Compute what the report says of shape matching beside its tables."""

from typing import Any

import pandas as pd

from palpate.report.report import Report
from palpate.studies.shape_matching.claims import held, lacking, limit, tips
from palpate.studies.shape_matching.maxwell_creep import closeness
from palpate.studies.shape_matching.shape_matching_timing import HEADLINE, exponents, headline


def numbers(report: Report) -> dict[str, Any]:
    """Return what the template names beside its tables."""
    found = report.tables
    pokes = found["body_springs"].groupby(["case", "body_springs_n_m"], sort=False)
    return {
        "case": HEADLINE,
        "step_s": 1e-3 * headline(found["shape_matching_timing"]),
        "limit": limit(found["integrator_stability"]),
        "tips": tips(found["clusters"]),
        "slopes": exponents(found["shape_matching_timing"]),
        "poked": pd.DataFrame([_poked(case, stiffness, rows) for (case, stiffness), rows in pokes]),
        "left": lacking(found["deformation_modes"]).T,
        "closeness": closeness(found["maxwell_creep"]) if "maxwell_creep" in found else None,
    }


def _poked(case: str, stiffness: float, rows: pd.DataFrame) -> dict[str, Any]:
    """Return how deep and wide a surface gives way at the end of the hold, and what is left of it in the end."""
    end, last = held(rows), rows[rows["time_s"] == rows["time_s"].max()]
    depth = end["max_displacement_m"].max()
    return {
        "body springs": {"none": "without", "dampers_only": "their dampers only"}.get(case, f"{stiffness:g} N/m"),
        "depth [mm]": 1e3 * depth,
        "nodes moved": end["moved"].sum(),
        "of": end["nodes"].sum(),
        "left [%]": 100 * last["max_displacement_m"].max() / depth,
    }
