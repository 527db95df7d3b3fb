"""Compute how much stiffer than a slab a ball must be to be felt."""

from typing import Any

from palpate.report.report import Report
from palpate.studies.palpation.palpation import least_contrasts


def numbers(report: Report) -> dict[str, Any]:
    """Return what the template names beside its tables."""
    return {"contrasts": sorted(least_contrasts(report.tables["palpation_limits"]).items())}
