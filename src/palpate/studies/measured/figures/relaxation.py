"""Relaxation of pressed tissue: forces, modulus over time, errors of what was left out, and what shapes depend on."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from palpate.report import style, tables
from palpate.report.turnable import evenly
from palpate.report.words import percent
from palpate.studies.measured.figures.bars import figure_of_errors
from palpate.studies.measured.relaxed import DEPTH, EARLY_S, HELD, MEAN, NOTHING, POWER, SESSION, SIBLINGS, SPECIMEN

WAYS = {SPECIMEN: "specimen", SESSION: "session", DEPTH: "the deeper half", NOTHING: "nothing (own fit)"}
PREDICTED = 6
"""Presses whose prediction is drawn, too."""


@style.figure(
    "relaxation", tables=("relaxation_curves", "relaxation_errors", "relaxation_presses", "relaxation_trends")
)
def draw_relaxation(
    relaxation_curves, relaxation_errors, relaxation_presses, relaxation_trends, *, scene: str
) -> Figure:
    """Draw what the presses of one entry say of relaxation."""
    all_tables = relaxation_curves, relaxation_errors, relaxation_presses, relaxation_trends
    curves, errors, presses, trends = (tables.where(table, entry=scene) for table in all_tables)
    of_presses = curves["press"].fillna("").ne("")
    models = [name for name in dict.fromkeys(errors["model"]) if "branch" in name and not name.startswith("own")]
    own_fits = {f"own: {name}": name for name in models}
    names = {name: name for name in (*models, POWER, MEAN, HELD)} | {SIBLINGS: "siblings' mean (floor)"} | own_fits
    shown = errors, "left_out", "error", WAYS, names, (SIBLINGS,), "over the peak"
    figure, grid = figure_of_errors(*shown, widths=(1.25, 1.0))
    specimens = list(dict.fromkeys(presses["specimen"].fillna("")))
    colours = {name: style.HUES[k % len(style.HUES)] for k, name in enumerate(specimens)}
    _forces(figure.add_subplot(grid[0, 0]), curves[of_presses], colours)
    inner = grid[1, 0].subgridspec(1, 2)
    _modulus(figure.add_subplot(inner[0]), curves[~of_presses], presses)
    _shape(figure.add_subplot(inner[1]), presses, trends, colours)
    return figure


def _forces(axis: Axes, curves, colours: dict[str, str]) -> None:
    """Draw the force of each press over the time that its depth is held, and the prediction of PREDICTED of them."""
    end_forces = curves.groupby("press", sort=False)["measured"].last().sort_values()
    predicted = set(end_forces.index[evenly(len(end_forces), PREDICTED)])
    labelled: set[str] = set()
    for name, rows in curves.groupby("press", sort=False):
        specimen = rows["specimen"].fillna("").iloc[0]
        label = (specimen or "measured") if specimen not in labelled else None
        labelled.add(specimen)
        axis.plot(rows["time_s"], rows["measured"], color=colours[specimen], lw=0.7, alpha=0.7, label=label)
        if name in predicted:
            axis.plot(rows["time_s"], rows["predicted"], color=style.INK, lw=1.0, ls="--")
    axis.plot([], [], color=style.INK, lw=1.0, ls="--", label="predicted by the others")
    axis.set(xscale="log", xlabel="time at the held depth [s]", ylabel="force over its peak")
    style.plain_log(axis.xaxis)
    axis.legend(loc="lower left", fontsize=7)


def _modulus(axis: Axes, rows, presses) -> None:
    """Draw the modulus over time with its interval; grey where it is extrapolated from what presses show."""
    times = rows["time_s"]
    axis.fill_between(times, rows["low"], rows["high"], color="#d5e1ec", lw=0)
    axis.plot(times, rows["predicted"], color="#0072b2")
    median_hold = float(presses["held_s"].median())
    for low, high in ((times.min(), 0.1), (median_hold, times.max())):
        axis.axvspan(low, high, color="#eeeeee", lw=0, zorder=0)
    axis.set(xscale="log", xlabel="time [s]", ylabel=f"modulus over that at {EARLY_S:g} s")
    axis.set_xlim(times.min(), times.max())
    axis.set_title("grey: extrapolated", fontsize="small", weight="normal")
    style.plain_log(axis.xaxis)


def _shape(axis: Axes, presses, trends, colours: dict[str, str]) -> None:
    """Draw late_over_early of each press over its strain, or depth, and how much it changes over their range."""
    by_strain = presses["thickness_m"].notna().all()
    quantity = "strain" if by_strain else "depth_m"
    x = presses["depth_m"] / presses["thickness_m"] if by_strain else 1e3 * presses["depth_m"]
    for specimen, rows in presses.groupby(presses["specimen"].fillna(""), sort=False):
        axis.plot(x[rows.index], rows["late_over_early"], ".", color=colours[specimen])
    axis.set(
        xlabel="depth over thickness" if by_strain else "depth [mm]", ylabel=f"modulus at the end over at {EARLY_S:g} s"
    )
    trend = tables.where(trends, over=quantity)
    if len(trend):
        row = trend.iloc[0]
        interval = f"{percent(row['slope_low'])} to {percent(row['slope_high'])}"
        axis.set_title(f"over its range: {interval}", fontsize="small", weight="normal")
