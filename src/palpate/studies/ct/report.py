"""Compute what the report says of bodies from CT and MRI beside their tables."""

from typing import Any

from palpate.report.report import Report
from palpate.studies.ct.claims import ELEMENTS
from palpate.table_declaration import Table

MESH_QUALITY = Table(
    "mesh_quality",
    "The extreme angles, the worst shape and the volume of each level of a body's meshes.",
    """
    body level: a body, and a level of its meshes
    min_dihedral_deg max_dihedral_deg: extreme dihedral angles [°]
    min_radius_ratio volume_m3: worst ratio of radii of in- and circumsphere, and volume [m³]
    """,
)


def numbers(report: Report) -> dict[str, Any]:
    """Return what the template names beside its tables."""
    report.check(("mesh_quality", "mask_interpolation"), "body", report.cts)
    return {"bodies": report.cts, "enough_elements": ELEMENTS}
