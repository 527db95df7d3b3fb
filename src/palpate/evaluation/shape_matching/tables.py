"""Declare the tables of paper 3's study of shape matching: the columns that are read, and a description."""

from palpate.evaluation.table import Table

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
    "shape_matching_timing": Table(
        "particles clusters mode objects all_particles memberships ms_per_step threads",
        "The time of one step of shape matching, by particles, clusters, objects and kind of deformation.",
    ),
    "body_springs": Table(
        "case body_springs_n_m time_s phase distance_m mean_displacement_m max_displacement_m nodes moved",
        "The displacement of the nodes around a poke over time, with and without virtual body springs.",
    ),
}
