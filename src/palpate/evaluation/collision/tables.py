"""Declare the tables of paper 3's study of collision: the columns that are read, and a description."""

from palpate.evaluation.table import Table

TABLES = {
    "collision": Table(
        "scene structure depths rival triangles build_ms refit_ms query_ms frame_ms node_tests "
        "triangle_tests pairs missed_pairs extra_pairs rebuilds frames threads",
        "The times, the tests, and the missed and extra pairs of each bounding structure in each scene.",
    ),
    "collision_scaling": Table(
        "structure depths rival triangles build_ms refit_ms query_ms pairs threads",
        "The times of each bounding structure over the number of triangles.",
    ),
    "collision_claims": Table(
        "claim paper measured verdict",
        "Each claim of paper 3 about its composite tree, what this run measured, and whether it confirms the claim.",
    ),
}
