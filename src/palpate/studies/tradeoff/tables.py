"""Declare the tables of the comparison of models: the columns that are read, and a description."""

from palpate.report.table import Table

TABLES = {
    "accuracy_vs_time": Table(
        "scene body regime model setting sees prepared law protocol split samples failures rmse_m rmse_of_peak "
        "relative_l2 p95_of_peak max_of_peak patch_rms_of_peak patch_max_of_peak operator_rmse_of_peak "
        "rmse_of_peak_median rmse_of_peak_p95 relative_l2_median relative_l2_p95 patch_rms_of_peak_median "
        "patch_rms_of_peak_p95 patch_max_of_peak_median patch_max_of_peak_p95 validation_rmse_of_peak "
        "validation_patch_rms_of_peak online_median_s online_p95_s offline_s memory_mb break_even_queries threads "
        "commit failure",
        "The error against the truth, the time, the preparation and the memory of every model at each of its settings.",
    ),
    "truth": Table(
        "scene radius_m samples rejected elements level nodes inverted rmse_of_peak relative_l2 patch_rms_of_peak "
        "order ratio_min ratio_max least_det squeezed volume_change iterations cycles seconds "
        "validation_samples validation_rmse_of_peak validation_patch_rms_of_peak",
        "How exactly the truth of each scene is known: its own error, that of samples which only choose settings and "
        "do without the finest mesh, and the mesh and time that it takes; and what of its volume the body loses.",
    ),
    "advice": Table(
        "scene error split budget_ms max_error model setting rmse_of_peak patch_rms_of_peak validation_error error_low "
        "error_high bound_of_peak p95_of_peak online_p95_s margin confidence rival rival_setting factor "
        "reference_error faster faster_setting faster_error faster_high faster_factor speed times_life bound_on why",
        "The model and setting to take for each limit of time or error, the next best one, and the reason.",
    ),
    "error_bounds": Table(
        "scene body regime model setting error estimate contacts samples rank_correlation error_of_peak bound_factor "
        "bound_of_peak sharpness coverage coverage_low coverage_of_contacts coverage_elsewhere estimate_s",
        "Below what the error of a single answer stays in nine cases of ten, by what that is estimated from, and how "
        "often it did.",
    ),
    "advice_agreement": Table(
        "scene body regime error budget_ms max_error model setting splits same same_setting others rmse_of_peak "
        "patch_rms_of_peak least most",
        "How many of the splits advise the same model for each limit.",
        always=False,
    ),
    "advice_by_radius": Table(
        "body error split budget_ms max_error radius_m model setting rmse_of_peak patch_rms_of_peak flips",
        "What is advised for fingers of several radii, and where that changes.",
        always=False,
    ),
    "any_load": Table(
        "scene body regime model setting kind samples refused doubted failures contacts rmse_of_peak relative_l2 "
        "patch_rms_of_peak patch_max_of_peak force_error rmse_of_peak_most patch_rms_of_peak_most force_error_most "
        "online_median_s online_p95_s preparation_s offline_s memory_mb failure",
        "Loads that models were not prepared for, against the fine operator: a place between contacts, two contacts, a "
        "disc pushed to a depth.",
        always=False,
    ),
    "beyond_design": Table(
        "scene body regime model setting kind samples unsound right doubted needless wrong rmse_most patch_max_most",
        "Presses that models were not made for: how many answers are right, doubted by the model itself (needlessly), "
        "or wrong without a word; unsound presses have no answer that would be right.",
        always=False,
    ),
    "limit_points": Table(
        "body contact pressure_of_young peak_of_size least_det converged",
        "The dent under a growing pressure, contact by contact: where the law itself has more than one answer.",
        always=False,
    ),
}
