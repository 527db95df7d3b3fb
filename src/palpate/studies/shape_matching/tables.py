"""Declare the tables of paper 3's study of shape matching: the columns that are read, and a description."""

from palpate.report.table import Table

TABLES = {
    "integrator_stability": Table(
        "scheme alpha h_over_sqrt_m_k spectral_radius growth_measured limit_stated blow_up_measured",
        (
            "The predicted and the measured growth of an oscillator under each time integrator, over the length of "
            "the step."
        ),
    ),
    "clusters": Table(
        "clusters force_n particle rest_x_m rest_y_m rest_z_m x_m y_m z_m",
        "The rest position and the bent position of every particle of a column, for each number of clusters.",
    ),
    "deformation_modes": Table(
        "deformation mode particle rest_x_m rest_y_m rest_z_m x_m y_m z_m goal_x_m goal_y_m goal_z_m left",
        "The goals that each mode of shape matching has for a block that is deformed in four ways.",
    ),
    "cluster_goals": Table(
        (
            "kind goals clusters memberships clusters_mean clusters_most alpha_limit alpha_limit_measured alpha peak_m "
            "drift"
        ),
        "The column in clusters as the thesis has them, one a tetrahedron and added, beside fewer and averaged ones.",
    ),
    "maxwell_creep": Table(
        "scene time_s load creep_m closed_m springs_m",
        "The displacement of springs with Maxwell dampers over time, and its closed solution.",
        always=False,
    ),
    "shape_matching_timing": Table(
        "particles clusters mode objects all_particles memberships ms_per_step threads",
        "The time of one step of shape matching, by particles, clusters, objects and kind of deformation.",
    ),
    "body_springs": Table(
        "case body_springs_n_m time_s phase distance_m mean_displacement_m max_displacement_m nodes moved",
        "The displacement of the nodes around a poke over time, with and without virtual body springs.",
    ),
}
