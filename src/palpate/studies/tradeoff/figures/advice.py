"""Errors of the advised model and of the next best model within each budget, over the surface and at the patch."""

from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from palpate.benchmark.comparison import EQUAL, KINDS
from palpate.report import style, tables
from palpate.report.model_looks import label, look
from palpate.studies.tradeoff.advice import NONE
from palpate.studies.tradeoff.figures.precision_panel import LEAST
from palpate.studies.tradeoff.figures.scene_rows import averaged, first_split, own_error

TABLES = ("advice", "accuracy_vs_time")
NAMES = {"rms": "RMSE", "patch": "RMS at the patch"}
"""The kinds of error that advice is asked for, as axes name them."""


@style.styled
def draw(advice, accuracy_vs_time) -> Figure:
    """Draw the advised model with its interval, the next best and the factor; a column of panels per budget.

    advice, accuracy_vs_time : the tables of these names
    The upper panels are for the error over the surface, the lower ones for that at the patch; each has a row per scene.
    """
    names = tables.scenes(accuracy_vs_time)
    asked = first_split(advice[advice["scene"].isin(names)].dropna(subset="budget_ms"))
    kinds = [kind for kind in KINDS if kind in set(asked["error"])]
    budgets = list(dict.fromkeys(asked["budget_ms"]))
    rows = {scene: averaged(tables.where(accuracy_vs_time, scene=scene)) for scene in names}
    size = (1.4 + 3.3 * len(budgets), 0.6 + len(kinds) * (0.75 + 0.56 * len(names)))
    figure = Figure(figsize=size, layout="constrained")
    panels = figure.subplots(len(kinds), len(budgets), sharex="row", sharey=True, squeeze=False)
    for line, kind in zip(panels, kinds, strict=True):
        column = KINDS[kind]
        for axis, budget in zip(line, budgets, strict=True):
            for place, scene in enumerate(names):
                found = tables.where(asked, error=kind, budget_ms=budget, scene=scene)
                for row in found.itertuples():
                    _row(axis, place, row, rows[scene], column)
            axis.set(xscale="log", title=f"within {budget:g} ms", xlabel=f"{NAMES[kind]} [% of peak]")
            axis.grid(axis="y", visible=False)
        low, high = line[0].get_xlim()
        line[0].set_xlim(low / 4, high * 4)  # room for the names beside the points
        for axis in line:
            _truth(axis, rows, column)
            style.plain_log(axis.xaxis)
    panels[0, 0].set_yticks(range(len(names)), [scene.replace("_", " ") for scene in names])
    panels[0, 0].set_ylim(len(names) - 0.4, -0.75)
    figure.legend(handles=_legend(), loc="outside lower center", ncols=3)
    return figure


def _legend() -> list:
    next_best = Line2D([], [], ls="", marker="o", mfc="white", mec=style.FAINT, label="next best model")
    taken = Line2D([], [], marker="o", color=style.INK, label="advised, with 5 to 95 % of draws of the contacts")
    return [taken, next_best, Patch(color="#e6e6e6", label="below the error of the truth itself")]


def _truth(axis, rows: dict, column: str) -> None:
    """Draw in grey what is below the truth's own error, in each row."""
    low = axis.get_xlim()[0]
    for place, settings in enumerate(rows.values()):
        own = 100 * own_error(settings, column)
        if own > low:
            axis.fill_betweenx([place - 0.4, place + 0.4], low, own, color="#e6e6e6", lw=0, zorder=0)


def _row(axis, place: int, row, settings, column: str) -> None:
    """Draw one scene in one panel."""
    if row.model == NONE:
        axis.text(0.5, place, "none", transform=axis.get_yaxis_transform(), ha="center", va="center", color="#aa0000")
        return
    shown, error = look(row.model), _error(settings, row.model, row.setting, column)
    if row.factor > 0:
        rival = _error(settings, row.rival, row.rival_setting, column)
        axis.plot([error, rival], [place, place], color="#dddddd", lw=1, zorder=1)
        axis.plot(rival, place, marker=look(row.rival).marker, mfc="white", mec=style.FAINT, ms=6, zorder=2)
        times = f"{float(f'{row.factor:.2g}'):g}×" if row.factor < 1000 else "over 1000×"
        times += ", smaller on test" if row.factor < 1 / EQUAL else ""
        _beside(axis, rival, place, f"{label(row.rival, 'default')}: {times}", -1, "#666666")
    ends = [max(100 * row.error_low, LEAST), max(100 * row.error_high, LEAST)]
    axis.plot(ends, [place, place], color=shown.colour, lw=3, alpha=0.45)
    size = 11 if shown.marker == "*" else 7
    axis.plot(error, place, marker=shown.marker, color=shown.colour, mec="white", mew=0.5, ms=size, zorder=3)
    _beside(axis, error, place, label(row.model, "default"), 1, shown.colour)


def _error(settings, model: str, setting: str, column: str) -> float:
    """Return the error of a setting in %; nearly exact answers are drawn at the edge, as in the diagrams."""
    return max(100 * tables.where(settings, model=model, setting=setting)[column].iloc[0], LEAST)


def _beside(axis, x: float, place: int, text: str, side: int, colour: str) -> None:
    """Draw a name above (1) or below (-1) its point."""
    va = "bottom" if side > 0 else "top"
    axis.annotate(
        text, (x, place), (0, 5 * side), textcoords="offset points", ha="center", va=va, fontsize=7, color=colour
    )
