"""Signed errors along x, y and z over the steps, for the fitted press and the two others (paper 2's figure 3)."""

from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from palpate.report import style, tables
from palpate.report.spring_looks import DASHES, FITS, FORCES, look

TABLES = ("spring_errors",)
SHOWN = ["uniform", "genetic", "gradient", "gradient_smooth", "gradient_all"]
"""The simplest method, the paper's, and the fits by gradient; the table has the others."""


@style.styled
def draw(spring_errors) -> Figure:
    """Draw the error of the point that moves most, one row for each press and one column for each axis.

    It is simulated minus reference, the median of the seeds. A row says how far anything moves, which is the error of
    an answer without motion.

    spring_errors : the table of this name
    """
    errors = spring_errors
    # gradient_all is fitted to all presses, which is not counted here
    presses = errors.groupby("press", sort=False)["used_in_fit"].mean() > 0.5
    figure = Figure(figsize=(9.5, 2.1 * len(presses) + 1.1), layout="constrained")
    grid = figure.subplots(len(presses), 3, sharex=True, sharey="row", squeeze=False)
    shown = errors[errors["method"].isin(SHOWN)]
    for axes, (press, fitted) in zip(grid, presses.items(), strict=True):
        for axis, name in zip(axes, "xyz", strict=True):
            for (method, force), rows in tables.where(shown, press=press).groupby(["method", "volume_force"]):
                curve = (1e3 * rows.groupby("step")[f"error_{name}_m"].median()).sort_index()
                axis.plot(curve.index, curve, color=look(method).colour, ls=DASHES[force], lw=1.2)
            axis.axhline(0.0, color=style.FAINT, lw=0.8)
            axis.set_title(f"{press} press, {name}{' (fitted)' if fitted else ''}")
        moved = 1e3 * tables.where(shown, press=press)["zero_m"].max()
        axes[0].set_ylabel(f"error [mm]\nmoved: {moved:.2g} mm")
    for axis in grid[-1]:
        axis.set_xlabel("step")
    ways = [Line2D([], [], color=FITS[m].colour, label=FITS[m].label) for m in SHOWN if m in set(shown["method"])]
    forces = [Line2D([], [], color=style.INK, ls=DASHES[force], label=FORCES[force]) for force in FORCES]
    figure.legend(handles=[*ways, *forces], loc="outside upper center", ncols=3)
    return figure
