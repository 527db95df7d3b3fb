"""Declare the tables of paper 3's study of collision: the columns that are read, and a description."""

from palpate.report.table import Table

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
    "collision_precision": Table(
        "scene structure depths exact layer triangles refit_ms contacts_ms frame_ms tests contacts false_pairs "
        "missed_pairs frames_apart false_frames reported_m nearest_m place_error_m direction_error_deg depth_error_m "
        "velocity_error_m_s response_error_m response_m frames threads",
        "The time and the errors of contacts from bounding trees that are stopped at a layer, and from whole trees.",
    ),
    "collision_apart": Table(
        "bodies structure depths rival triangles gap_m refit_ms query_ms frame_ms node_tests triangle_tests "
        "roots_overlap extra_pairs placements threads test_ns",
        "The times and the tests with which each bounding structure shows that two bodies are apart.",
    ),
}
