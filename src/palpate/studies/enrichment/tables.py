"""Declare the tables of paper 1's study: the columns that are read, and a description."""

from palpate.report.table import Table

TABLES = {
    "mesh_sizes": Table(
        "body level surface_nodes surface_triangles nodes tetrahedra paper_nodes paper_triangles",
        "The size of each body's meshes, level 0 being the coarse one, beside the counts that paper 1 publishes.",
    ),
    "splits": Table(
        "body regime split train test",
        "How many samples of each body and regime the methods learn from, and how many they are tested on.",
    ),
    "sigma_sweep": Table(
        "body regime protocol split features weights sigma_m sigma_relative rmse_m rmse_of_peak",
        "The test error of each blend at every width σ of its Gaussian kernel.",
    ),
    "enrichment_accuracy": Table(
        "body regime protocol split method sigma_m samples rmse_m rmse_of_peak p95_of_peak max_of_peak",
        "The test errors of each method in every body, regime, protocol and split; blends at their best width σ.",
    ),
    "enrichment_timing": Table(
        "body method d1_s d2_s d3_s d4_s d5_s mean_s paper_mean_s",
        "The time of five answers of each method, and their mean, laid out like table 4 of paper 1.",
    ),
    "online_cost": Table(
        "body method protocol online_median_s online_p95_s",
        "The time that each method needs for one answer once it is prepared: median and 95th percentile.",
    ),
    "complexity": Table(
        "operation paper_order exponent_r exponent_r_low exponent_r_high paper_exponent_r exponent_k "
        "exponent_k_low exponent_k_high paper_exponent_k",
        "Measured exponents of each operation's time in the numbers of features r and samples k, with 95 % intervals.",
    ),
    "fem_cost": Table(
        "body regime sample newton_iterations linear_solves residual seconds",
        "The work, the time and the last residual of each finite-element simulation on the fine mesh.",
    ),
    "premises": Table(
        "premise held_out train features weights splits rmse_of_peak error_low error_high ratio ratio_low ratio_high",
        "The test errors of each kind of feature and weights in each premise, mean of all splits, and their ratio to "
        "those of unordered features, both with intervals that hold 90 % of draws of splits and contacts.",
    ),
    "premise_bodies": Table(
        "premise body responses made_of held contacts moved_share",
        "How the body of each premise is made and held, how many contacts can be pressed, and what share of its "
        "surface moves by more than a tenth of the peak.",
    ),
    "feature_vectors": Table(
        "premise features press contact node axis share_of_peak",
        "The feature vectors of two presses in the same direction at two contacts of each premise.",
    ),
    "database_memory": Table(
        "premise features train features_kb fine_kb matrix_kb orders_kb total_kb",
        "The memory of all that a query may need: feature vectors, fine displacements, the matrix A, orders of nodes.",
    ),
    "sample_peaks": Table(
        "body regime sample peak_m",
        "The largest displacement of the surface in each sample.",
    ),
}
