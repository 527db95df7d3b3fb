"""Declare the tables of the scenes: the columns that are read, and a description."""

from palpate.report.table import Table

TABLES = {
    "scene_effects": Table(
        "scene effect called reason",
        "The effects that act in each scene or not, with the reason.",
    ),
    "effects": Table(
        "scene effect ms_per_step share_of_step memory_kb error_if_left_out",
        "The time and memory that each effect takes, and the error if it is left out.",
    ),
    "energy": Table(
        "scene time_s kinetic_j outer_work_j total_j gain_j",
        "The kinetic energy, the energy of each effect, the work of loads and instruments over time, and the most that "
        "a step has gained beyond its work.",
    ),
    "energy_balance": Table(
        "scene integrator work_j gain_j gain_of_work verdict guaranteed",
        "The most that the energy of each scene rose in a step beyond the work of that step.",
    ),
    "contact_force": Table(
        "scene instrument time_s force_x_n force_y_n force_z_n force_n depth_m",
        "The force on each moved instrument over time, and its depth below the body's surface at rest.",
        always=False,
    ),
}
