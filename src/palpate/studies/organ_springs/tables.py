"""Declare the tables of paper 2's chain for an organ: the columns that are read, and a description."""

from palpate.report.table import Table

TABLES = {
    "organ_springs": Table(
        "body model volume_force seed contact used_in_fit rmse_m peak_m rmse_of_peak reference_error ms_a_second "
        "step_s offline_s evaluations",
        "The error of an organ's springs, however fitted, of coarse finite elements and of shape matching, at each "
        "contact, and what a second of motion takes them.",
    ),
    "organ_history": Table(
        "body model volume_force seed generation evaluations seconds fitness",
        "The best fitness so far in each generation or iteration of each search for an organ's springs.",
    ),
    "mass_motion": Table(
        "body from_ct masses total_kg least_node_of_uniform most_node_of_uniform frequency_hz change_of_frequency "
        "change_of_motion",
        "What the masses of an organ's nodes change in its slowest modes and in its motion under the fitted presses.",
    ),
}
