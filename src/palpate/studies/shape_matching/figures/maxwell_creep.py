"""Creep of springs with Maxwell dampers under a constant load, and their recovery, beside the closed solution."""

from matplotlib.figure import Figure

from palpate.report import style

TABLES = ("maxwell_creep",)


@style.styled
def draw(maxwell_creep) -> Figure:
    """Draw the displacement over time, simulated and in closed form, and below the difference of the two.

    maxwell_creep : the table of this name
    """
    table = maxwell_creep
    figure = Figure(figsize=(6.5, 4.6), layout="constrained")
    moved, error = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
    times, colour = table["time_s"], style.effect_colour("maxwell")
    moved.plot(times, 1e3 * table["springs_m"], color=style.FAINT, ls="--", label="springs alone")
    moved.plot(times, 1e3 * table["closed_m"], color=style.INK, lw=1.2, label="closed solution")
    moved.plot(times, 1e3 * table["creep_m"], "o", color=colour, ms=4, mec="white", mew=0.4, label="simulated")
    error.axhline(0.0, color=style.FAINT, lw=0.8)
    largest = table["closed_m"].abs().max()
    error.plot(times, 100.0 * (table["creep_m"] - table["closed_m"]) / largest, "o-", color=colour, ms=3)
    moved.set(ylabel="displacement [mm]", title=str(table["scene"].iloc[0]).replace("_", " "))
    error.set(xlabel="time [s]", ylabel="difference\n[% of largest]")
    moved.legend()
    return figure
