"""Declare the table of the study of the law: the columns that are read, and a description."""

from palpate.report.table import Table

TABLES = {
    "law": Table(
        "body changed law poisson contact depth_of_size force_n peak_of_size change_rmse_of_peak change_relative_l2 "
        "change_patch_rms_of_peak linear_rmse_of_peak linear_relative_l2 linear_patch_rms_of_peak "
        "quadratic_rmse_of_peak quadratic_relative_l2 quadratic_patch_rms_of_peak finest_rmse_of_peak "
        "finest_relative_l2 finest_patch_rms_of_peak own_rmse_of_peak volume_change least_det iterations "
        "cycles believed why",
        "The same presses under each law: what it changes, beside the errors of three meshes against its own truth, "
        "the volume that the body loses, and what the solutions took.",
    ),
}
