"""Compute what the report says of shape matching beside its tables."""

from typing import Any

import pandas as pd

from palpate.report.report import Report
from palpate.studies.shape_matching.claims import lacking, limit, pokes, tips
from palpate.studies.shape_matching.maxwell_creep import closeness
from palpate.studies.shape_matching.shape_matching_timing import HEADLINE, exponents, headline


def numbers(report: Report) -> dict[str, Any]:
    """Return what the template names beside its tables."""
    by_name = report.tables
    poked = pokes(by_name["body_springs"])
    named = {"none": "without", "dampers_only": "their dampers only"}
    return {
        "case": HEADLINE,
        "step_s": 1e-3 * headline(by_name["shape_matching_timing"]),
        "limit": limit(by_name["integrator_stability"]),
        "tips": tips(by_name["clusters"]),
        "slopes": exponents(by_name["shape_matching_timing"]),
        "poked": pd.DataFrame(
            {
                "body springs": [named.get(row.case, f"{row.body_springs_n_m:g} N/m") for row in poked.itertuples()],
                "depth [mm]": 1e3 * poked["depth_m"],
                "nodes moved": poked["moved"],
                "of": poked["nodes"],
                "left [%]": 100 * poked["left_m"] / poked["depth_m"],
            }
        ),
        "left": lacking(by_name["deformation_modes"]).T,
        "closeness": closeness(by_name["maxwell_creep"]) if "maxwell_creep" in by_name else None,
    }
