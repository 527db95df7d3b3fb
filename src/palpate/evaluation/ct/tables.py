"""Declare the tables of bodies from CT: the columns that are read, and a description."""

from palpate.evaluation.table import Table

TABLES = {
    "node_mass": Table(
        "body elements nodes total_mass_kg mean_density_kg_m3 deviation_from_voxels raw_deviation",
        "The mass of each body from CT at several mesh sizes, and its deviation from the mass of the voxels.",
    ),
    "mesh_quality": Table(
        "body level min_dihedral_deg max_dihedral_deg min_radius_ratio volume_m3",
        "The extreme angles, the worst shape and the volume of each level of a body's meshes.",
    ),
}
