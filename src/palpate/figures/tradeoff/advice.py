"""Errors of the advised model and of the next best model within each budget."""

from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from palpate.evaluation.tradeoff.advice import NONE
from palpate.figures import style, tables
from palpate.figures.model_looks import label, look
from palpate.figures.tradeoff.work_precision import LEAST

TABLES = ("advice", "accuracy_vs_time")


@style.styled
def draw(advice, accuracy_vs_time) -> Figure:
    """Draw the advised model with its interval, the next best and the factor; a panel per budget, a row per scene.

    advice, accuracy_vs_time : the tables of these names
    """
    names = tables.scenes(accuracy_vs_time)
    asked = advice[advice["scene"].isin(names)].dropna(subset="budget_ms")
    budgets = list(dict.fromkeys(asked["budget_ms"]))
    figure = Figure(figsize=(1.2 + 3.3 * len(budgets), 1.1 + 0.62 * len(names)), layout="constrained")
    panels = figure.subplots(1, len(budgets), sharex=True, sharey=True, squeeze=False)[0]
    for axis, budget in zip(panels, budgets, strict=True):
        for place, scene in enumerate(names):
            [row] = tables.where(asked, budget_ms=budget, scene=scene).itertuples()
            _row(axis, place, row, tables.where(accuracy_vs_time, scene=scene))
        axis.set(xscale="log", title=f"within {budget:g} ms", xlabel="RMSE [% of peak]")
        axis.grid(axis="y", visible=False)
    panels[0].set_yticks(range(len(names)), [scene.replace("_", " ") for scene in names])
    panels[0].set_ylim(len(names) - 0.4, -0.75)
    low, high = panels[0].get_xlim()
    panels[0].set_xlim(low / 4, high * 4)  # room for the names beside the points
    style.plain_log(panels[0].xaxis)
    next_best = Line2D([], [], ls="", marker="o", mfc="white", mec=style.FAINT, label="next best model")
    taken = Line2D([], [], marker="o", color=style.INK, label="advised, with 5 to 95 % of draws of the contacts")
    figure.legend(handles=[taken, next_best], loc="outside lower center", ncols=2)
    return figure


def _row(axis, place: int, row, settings) -> None:
    """Draw one scene in one panel."""
    if row.model == NONE:
        axis.text(0.5, place, "none", transform=axis.get_yaxis_transform(), ha="center", va="center", color="#aa0000")
        return
    shown, error = look(row.model), _percent(row.rmse_of_peak)
    if row.factor > 0:
        rival = _percent(tables.where(settings, model=row.rival, setting=row.rival_setting)["rmse_of_peak"].iloc[0])
        axis.plot([error, rival], [place, place], color="#dddddd", lw=1, zorder=1)
        axis.plot(rival, place, marker=look(row.rival).marker, mfc="white", mec=style.FAINT, ms=6, zorder=2)
        times = f"{float(f'{row.factor:.2g}'):g}×" if row.factor < 1000 else "over 1000×"
        _beside(axis, rival, place, f"{label(row.rival, 'default')}: {times}", -1, "#666666")
    ends = [_percent(row.error_low), _percent(row.error_high)]
    axis.plot(ends, [place, place], color=shown.colour, lw=3, alpha=0.45)
    size = 11 if shown.marker == "*" else 7
    axis.plot(error, place, marker=shown.marker, color=shown.colour, mec="white", mew=0.5, ms=size, zorder=3)
    _beside(axis, error, place, label(row.model, "default"), 1, shown.colour)


def _percent(share: float) -> float:
    """Convert an error to %; nearly exact answers are drawn at the edge, as in the work–precision diagrams."""
    return max(100 * share, LEAST)


def _beside(axis, x: float, place: int, text: str, side: int, colour: str) -> None:
    """Draw a name above (1) or below (-1) its point."""
    va = "bottom" if side > 0 else "top"
    axis.annotate(
        text, (x, place), (0, 5 * side), textcoords="offset points", ha="center", va=va, fontsize=7, color=colour
    )
