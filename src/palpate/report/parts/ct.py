"""Bodies from CT in the report: segmentation, volume rendering, mesh, and the masses of its nodes."""

from palpate.figures import tables
from palpate.report import markup
from palpate.report.material import Report

TITLE = "From CT to body"


def sections(report: Report) -> list[tuple[str, str, str]]:
    """One section a body, then the masses of all of them."""
    return [
        *((f"ct_{body}", body.replace("_", " "), _body(report, body)) for body in report.cts),
        ("node_masses", "Masses from CT", report.figure("node_mass") + report.folded("node_mass")),
    ]


def _body(report: Report, body: str) -> str:
    """Slices, volume rendering and surfaces, and how well shaped the meshes are."""
    quality = tables.where(report.tables["mesh_quality"], body=body)
    return (
        report.figure(f"ct_slices_{body}", "ct_slices", body=body)
        + report.figure(f"ct_volume_{body}", "ct_volume", body=body)
        + markup.table(quality.drop(columns="body"), f"{body}: quality of its meshes")
    )
