"""Draw what is advised for fingers of several radii, and where that changes."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle

from palpate.benchmark.comparison import KINDS
from palpate.report import style, tables
from palpate.report.model_looks import look
from palpate.report.number_format import percent
from palpate.studies.tradeoff.advice import NONE

TABLES = ("advice_by_radius",)
WHERE = {"rms": "over the surface", "patch": "at the patch"}
"""The kinds of error that advice is for, in words."""


@style.styled
def draw(advice_by_radius) -> Figure:
    """Draw a cell for each question and radius, in the colour of the advised model; a panel per body and error.

    advice_by_radius : the table of this name, of which the first split is drawn
    A cell holds the error of the advised model. Where the model changes with the radius, a line stands between cells.
    """
    table = tables.where(advice_by_radius, split=advice_by_radius["split"].min())
    names, kinds = tables.bodies(table), [kind for kind in KINDS if kind in set(table["error"])]
    questions = [row for row in table[["budget_ms", "max_error"]].drop_duplicates().itertuples(index=False)]
    radii = sorted(set(table["radius_m"]))
    size = (1.6 + (0.4 + 0.85 * len(radii)) * len(kinds), 0.9 + (0.75 + 0.3 * len(questions)) * len(names))
    figure = Figure(figsize=size, layout="constrained")
    panels = figure.subplots(len(names), len(kinds), sharex=True, sharey=True, squeeze=False)
    for line, body in zip(panels, names, strict=True):
        for axis, kind in zip(line, kinds, strict=True):
            for y, asked in enumerate(questions):
                rows = tables.where(table, body=body, error=kind)
                rows = rows[_same(rows["budget_ms"], asked.budget_ms) & _same(rows["max_error"], asked.max_error)]
                for row in rows.sort_values("radius_m").itertuples():
                    _cell(axis, radii.index(row.radius_m), y, row, KINDS[kind])
            axis.set(title=f"{body.replace('_', ' ')}: error {WHERE[kind]}", xlim=(-0.5, len(radii) - 0.5))
            axis.grid(visible=False)
    panels[0, 0].set_ylim(len(questions) - 0.5, -0.5)
    panels[0, 0].set_xticks(range(len(radii)), [f"{1e3 * radius:g}" for radius in radii])
    panels[0, 0].set_yticks(range(len(questions)), [_limit(*asked) for asked in questions])
    for axis in panels[-1]:
        axis.set_xlabel("radius of the finger [mm]")
    models = [model for model in dict.fromkeys(table["model"]) if model != NONE]
    handles = [Patch(color=look(model).colour, alpha=0.55, label=look(model).label) for model in models]
    figure.legend(handles=handles, loc="outside lower center", ncols=2)
    return figure


def _same(values, wanted: float):
    """Mark the values that equal the one wanted, or are empty like it."""
    return values.isna() if np.isnan(wanted) else values == wanted


def _limit(budget_ms: float, max_error: float) -> str:
    return f"within {budget_ms:g} ms" if np.isfinite(budget_ms) else f"at most {percent(max_error)}"


def _cell(axis, x: int, y: int, row, column: str) -> None:
    """Draw one cell: the colour of the model, its error, and a line before it where the model has changed."""
    none = row.model == NONE
    colour = "#f4f4f4" if none else look(row.model).colour
    axis.add_patch(Rectangle((x - 0.5, y - 0.46), 1, 0.92, color=colour, alpha=1 if none else 0.55, lw=0))
    axis.text(x, y, NONE if none else percent(getattr(row, column)), ha="center", va="center", fontsize=8)
    if row.flips:
        axis.plot([x - 0.5, x - 0.5], [y - 0.5, y + 0.5], color="black", lw=3, solid_capstyle="butt")
