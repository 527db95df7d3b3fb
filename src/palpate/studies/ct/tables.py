"""Declare the tables of bodies from CT: the columns that are read, and a description."""

from palpate.report.table import Table

TABLES = {
    "node_mass": Table(
        "body elements nodes total_mass_kg mean_density_kg_m3 deviation_from_voxels raw_deviation",
        "The mass of each body from CT at several mesh sizes, and its deviation from the mass of the voxels.",
        always=False,
    ),
    "mesh_quality": Table(
        "body level min_dihedral_deg max_dihedral_deg min_radius_ratio volume_m3",
        "The extreme angles, the worst shape and the volume of each level of a body's meshes.",
    ),
    "mask_interpolation": Table(
        "body every method dice volume_deviation",
        "The mask of each body, drawn on every n-th slice and filled between, against the whole mask.",
    ),
    "surface_normals": Table(
        "blur_voxels normals_from points median_deg p95_deg rms_m",
        "Angles of a surface's normals to those of the exact liver, and the distance of its points from it.",
    ),
    "tissue_classes": Table(
        "method tissue wrong rms_error",
        "The tissues that voxels are taken for, by three methods, against what the synthetic abdomen is made of.",
    ),
    "segmented_scans": Table(
        "scan dice volume_deviation",
        "The liver found by one range of grey values in a synthetic CT and MRI, against the true one.",
    ),
    "compositing": Table(
        "looks order enough samples median_s difference",
        "Pictures composited in both orders: samples a ray takes, time, and difference from back to front.",
    ),
}
