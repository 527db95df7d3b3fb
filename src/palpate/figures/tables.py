"""Read result tables, and say which one is missing or misses a column."""

from collections.abc import Iterable
from pathlib import Path

import pandas as pd

from palpate.errors import InputError
from palpate.files import read_table

_D = [f"d{i}_s" for i in range(1, 6)]

ENRICHMENT = {
    "mesh_sizes": "body level surface_nodes surface_triangles nodes tetrahedra paper_nodes paper_triangles",
    "splits": "body regime split train test",
    "sigma_sweep": "body regime protocol split features weights sigma_m sigma_relative rmse_m rmse_of_peak",
    "enrichment_accuracy": (
        "body regime protocol split method sigma_m samples rmse_m rmse_of_peak p95_of_peak max_of_peak"
    ),
    "enrichment_timing": " ".join(["body method", *_D, "mean_s paper_mean_s"]),
    "online_cost": "body method protocol online_median_s online_p95_s",
    "complexity": (
        "operation paper_order exponent_r exponent_r_low exponent_r_high paper_exponent_r "
        "exponent_k exponent_k_low exponent_k_high paper_exponent_k"
    ),
    "fem_cost": "body regime sample newton_iterations linear_solves residual seconds",
    "claims": "claim paper ours verdict",
    "sample_peaks": "body regime sample peak_m",
}
SCENES = {
    "scene_effects": "scene effect called reason",
    "effects": "scene effect ms_per_step share_of_step memory_kb error_if_left_out",
    "energy": "scene time_s kinetic_j outer_work_j total_j",
}
CONTACT = {
    "contact_force": "scene instrument time_s force_x_n force_y_n force_z_n force_n depth_m",
}
SOFT_BODIES = {
    "integrator_stability": (
        "scheme alpha h_over_sqrt_m_k spectral_radius growth_measured limit_stated blow_up_measured"
    ),
    "clusters": "clusters force_n particle rest_x_m rest_y_m rest_z_m x_m y_m z_m",
    "shape_matching_timing": "particles clusters mode objects all_particles memberships ms_per_step threads",
    "body_springs": (
        "case body_springs_n_m time_s phase distance_m mean_displacement_m max_displacement_m nodes moved"
    ),
}
CT = {
    "node_mass": "body elements nodes total_mass_kg mean_density_kg_m3 deviation_from_voxels raw_deviation",
    "mesh_quality": "body level min_dihedral_deg max_dihedral_deg min_radius_ratio volume_m3",
}
SPRINGS = {
    "spring_fit": (
        "method volume_force seed press used_in_fit rmse_m rmse_of_peak max_x_m max_y_m max_z_m fitness generations "
        "evaluations seconds"
    ),
    "spring_history": "method volume_force seed generation evaluations seconds fitness",
    "spring_errors": "method volume_force seed press used_in_fit step error_x_m error_y_m error_z_m",
    "spring_floor": "poisson volume_force volume_n_m press rmse_m rmse_of_peak",
}
COLLISION = {
    "collision": (
        "scene structure depths rival triangles build_ms refit_ms query_ms frame_ms node_tests triangle_tests pairs "
        "missed_pairs extra_pairs rebuilds frames threads"
    ),
    "collision_scaling": "structure depths rival triangles build_ms refit_ms query_ms pairs threads",
    "collision_claims": "claim paper ours verdict",
}
TRADEOFF = {
    "accuracy_vs_time": (
        "scene body regime model setting protocol split samples failures rmse_m rmse_of_peak p95_of_peak max_of_peak "
        "online_median_s online_p95_s offline_s memory_mb break_even_queries threads commit failure"
    ),
    "advice": (
        "scene budget_ms max_error model setting rmse_of_peak error_low error_high p95_of_peak online_p95_s margin "
        "confidence rival rival_setting factor why"
    ),
}
SCALING = {
    "scaling": "kernel unit size stage seconds memory_mb threads seconds_exponent memory_exponent",
}
DYNAMIC = {
    "dynamic_accuracy": (
        "scene body model setting level nodes step_s steps failures rmse_m rmse_of_peak p95_of_peak max_of_peak "
        "ms_per_step step_p95_ms real_time_factor offline_s "
        "reference_level reference_nodes reference_step_s reference_change"
    ),
}
HARD_CASES = {
    "hard_cases": "family case source scene model outcome measure value bound declared passed message",
}
COLUMNS = (
    CT | CONTACT | ENRICHMENT | SCENES | SOFT_BODIES | SPRINGS | COLLISION | DYNAMIC | SCALING | TRADEOFF | HARD_CASES
)
"""The columns that the figures and the report read, by table; a table may have more."""


def read(path: str | Path, rows: bool = True) -> pd.DataFrame:
    """Read a CSV table whose file name is one of COLUMNS.

    Raises InputError if the file is missing or lacks a column, or if it has no rows and must have ``rows``.
    """
    path = Path(path)
    table = read_table(path, COLUMNS[path.stem].split())
    if rows and table.empty:
        raise InputError(f"{path} has no rows: delete it and make it again")
    return table


def read_all(folder: str | Path, names: Iterable[str]) -> dict[str, pd.DataFrame]:
    """The tables called ``names`` in ``folder``, by name."""
    return {name: read(Path(folder) / f"{name}.csv") for name in names}


def bodies(table: pd.DataFrame) -> list[str]:
    """The bodies of a table in the order in which they first appear."""
    return list(dict.fromkeys(table["body"]))


def scenes(table: pd.DataFrame) -> list[str]:
    """The scenes of a table in the order in which they first appear."""
    return list(dict.fromkeys(table["scene"]))


def where(table: pd.DataFrame, **equal) -> pd.DataFrame:
    """The rows whose columns equal the values given."""
    for column, value in equal.items():
        table = table[table[column] == value]
    return table
