"""The numbers that the captions and the headline of bodies from CT name, worked out from their tables."""

import pandas as pd

from palpate.figures import tables
from palpate.figures.number_format import each, percent

ENOUGH = 6000
"""The elements from which on paper 2 calls masses good."""


def numbers(all_tables: dict[str, pd.DataFrame]) -> dict[str, str]:
    """Every placeholder of these captions, as text; a phrase a body from CT where there are several."""
    masses, quality = all_tables["node_mass"], all_tables["mesh_quality"]
    cts = tables.bodies(masses)

    def phrases(phrase, table):
        return each(cts, lambda body: phrase(tables.where(table, body=body)))

    return {
        "headline_ct": f"Bodies from CT: {phrases(_made, quality)}; {phrases(_off, masses)}.",
        "total_masses": phrases(_total, masses),
        "mass_deviations": phrases(_off, masses),
        "raw_deviations": phrases(_raw, masses),
        "mean_densities": phrases(_density, masses),
        "least_angles": phrases(_made, quality),
    }


def _made(quality) -> str:
    """Volume and smallest dihedral angle of the coarse mesh and the smallest of all levels."""
    coarse = quality.sort_values("level").iloc[0]
    return f"{1e6 * coarse['volume_m3']:.1f} mL, smallest dihedral angle {quality['min_dihedral_deg'].min():.1f}°"


def _total(masses) -> str:
    return f"{masses['total_mass_kg'].min():.4g} to {masses['total_mass_kg'].max():.4g} kg"


def _off(masses) -> str:
    """The largest deviation from the voxels, of all meshes and of those with enough elements."""
    off, enough = masses["deviation_from_voxels"].abs(), masses["elements"] >= ENOUGH
    told = f"masses within {percent(off.max())} of the voxels'"
    return told + (f", {percent(off[enough].max())} from {ENOUGH} elements on" if enough.any() else "")


def _raw(masses) -> str:
    """The same for voxels as they are, at the coarsest and the finest mesh."""
    ends = masses.sort_values("elements")["raw_deviation"].iloc[[0, -1]]
    return " to ".join(f"{100 * share:+.2g}\u00a0%" for share in ends)


def _density(masses) -> str:
    return f"{masses['mean_density_kg_m3'].min():.0f} to {masses['mean_density_kg_m3'].max():.0f} kg/m³"
