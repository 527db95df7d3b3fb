"""Report on bodies from CT and MRI: segmentation, pictures, mesh, the masses of its nodes, and the steps between."""

import pandas as pd

from palpate.report import markup, tables
from palpate.report.material import Report, Section
from palpate.report.number_format import each, percent
from palpate.report.words import capital, spaced
from palpate.studies.ct import report_imaging as ct_imaging
from palpate.studies.ct.tables import TABLES

__all__ = ["TABLES", "TITLE", "numbers", "sections"]

TITLE = "From CT to body"
ENOUGH = 6000
"""The elements from which on paper 2 calls masses good."""


def numbers(report: Report) -> dict[str, str]:
    """Return every placeholder of these captions, as text; a phrase for each body where there are several."""
    report.check(("mesh_quality", "mask_interpolation"), "body", report.cts)
    quality = report.tables["mesh_quality"]
    masses = report.tables.get("node_mass")
    weighed = tables.bodies(masses) if masses is not None else []

    def phrases(phrase, table, bodies):
        return each(bodies, lambda body: phrase(tables.where(table, body=body)))

    def headline(body):
        made = f"{spaced(body)}, {_made(tables.where(quality, body=body))}"
        return f"{made}, {_deviation(tables.where(masses, body=body))}" if body in weighed else made

    found = {
        "headline": f"Bodies made from a scan: {'; '.join(map(headline, report.cts))}.",
        "least_angles": phrases(_made, quality, report.cts),
        **ct_imaging.numbers(report.tables),
    }
    return found | {
        key: phrases(phrase, masses, weighed)
        for key, phrase in (
            ("total_masses", _total),
            ("mass_deviations", _deviation),
            ("raw_deviations", _raw),
            ("mean_densities", _density),
        )
        if weighed
    }


def _made(quality: pd.DataFrame) -> str:
    """Return the volume of the coarse mesh, and the smallest dihedral angle of all levels."""
    coarse = quality.sort_values("level").iloc[0]
    return f"{1e6 * coarse['volume_m3']:.1f} mL, smallest dihedral angle {quality['min_dihedral_deg'].min():.1f}°"


def _total(masses: pd.DataFrame) -> str:
    return f"{masses['total_mass_kg'].min():.4g} to {masses['total_mass_kg'].max():.4g} kg"


def _deviation(masses: pd.DataFrame) -> str:
    """Return the largest deviation from the voxels, of all meshes and of those with enough elements."""
    far, enough = masses["deviation_from_voxels"].abs(), masses["elements"] >= ENOUGH
    phrase = f"masses within {percent(far.max())} of the voxels'"
    return phrase + (f", and within {percent(far[enough].max())} from {ENOUGH} elements on" if enough.any() else "")


def _raw(masses: pd.DataFrame) -> str:
    """Return the same for voxels as they are, at the coarsest and the finest mesh."""
    ends = masses.sort_values("elements")["raw_deviation"].iloc[[0, -1]]
    return " to ".join(f"{100 * share:+.2g}\u00a0%" for share in ends)


def _density(masses: pd.DataFrame) -> str:
    return f"{masses['mean_density_kg_m3'].min():.0f} to {masses['mean_density_kg_m3'].max():.0f} kg/m³"


def sections(report: Report) -> list[Section]:
    """Return a section for each body, then the masses of those from a CT, and the steps from a scan to a picture."""
    found = [(f"ct_{body}", capital(spaced(body)), _body(report, body)) for body in report.cts]
    if "node_mass" in report.tables:
        found.append(("node_masses", "Masses from CT", report.figure("node_mass") + report.folded("node_mass")))
    return [*found, ("imaging", "From a scan to a picture and a mask", _imaging(report))]


def _imaging(report: Report) -> str:
    return report.figure("ct_imaging") + report.folded(
        "mask_interpolation", "surface_normals", "tissue_classes", "segmented_scans", "compositing"
    )


def _body(report: Report, body: str) -> str:
    """Show slices, the volume and the surfaces of a body, and the quality of its meshes."""
    quality = tables.where(report.tables["mesh_quality"], body=body)
    return (
        report.figure(f"ct_slices_{body}", "ct_slices", body=spaced(body))
        + report.figure(f"ct_volume_{body}", "ct_volume", body=spaced(body))
        + markup.table(quality.drop(columns="body"), f"{capital(spaced(body))}: quality of its meshes")
    )
