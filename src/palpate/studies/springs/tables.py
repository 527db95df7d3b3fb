"""Declare the tables of paper 2's study: the columns that are read, and a description."""

from palpate.report.table import Table

TABLES = {
    "spring_fit": Table(
        "method volume_force seed press used_in_fit rmse_m rmse_of_peak max_x_m max_y_m max_z_m fitness "
        "generations evaluations seconds",
        "The error of the spring network on each press after each method of finding its parameters.",
    ),
    "spring_history": Table(
        "method volume_force seed generation evaluations seconds fitness",
        "The best fitness so far in each generation or iteration of each search.",
    ),
    "spring_errors": Table(
        "method volume_force seed press used_in_fit step error_x_m error_y_m error_z_m most_m zero_m",
        "The signed error of the point that moves most along each axis after every time step of each press, and the "
        "largest of all key points.",
    ),
    "spring_floor": Table(
        "poisson volume_force volume_n_m press rmse_m rmse_of_peak",
        "The least error that springs reach on each press, by the Poisson ratio of the material that they imitate.",
    ),
}
