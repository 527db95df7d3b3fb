"""Declare the tables of palpation: the columns that are read, and a description."""

from palpate.report.table import Table

TABLES = {
    "palpation": Table(
        "body contact cover_m force_n depth_m depth_without_m stiffer felt threshold",
        "Force and depth of a finger's presses at places ever farther from a region, and the depth without it.",
    ),
    "palpation_limits": Table(
        "cover_m ball_radius_m contrast force_n depth_m depth_without_m stiffer felt threshold products",
        "By how much a ball in a slab makes a finger's press stiffer, by its depth and its contrast.",
    ),
}
