"""Matrices of the outcomes of every model in every hard case."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from palpate.report import style
from palpate.report.model_looks import Look, look
from palpate.report.words import spaced

LOOKS = {
    "stable": Look("stable: within the bound", "#8fd3bd", ""),
    "refused": Look("refused, with a reason", "#8cc4e6", "r"),
    "not_converged": Look("not converged, and reported", "#f0c94a", "n"),
    "wrong": Look("wrong", "#d55e00", "w"),
    "nan": Look("not a number", "#111111", "∞"),
}
"""Each outcome's label, colour, and the letter that shows it without colour."""
COLUMNS = ((("fem", "dynamics"),), (("enrichment",), ("contact",), ("organ",), ("cuts",)))
"""Families by matrix, and matrices from left to right and from top to bottom."""
TITLES = {"fem": "elasticity"}
"""Families that are not shown by their own name."""
CELL = 0.165  # [inch]
LEFT, LETTER, BELOW = 2.2, 0.056, 0.75  # [inch] for names of cases, a letter of a model's name, and the legend


@style.figure("hard_cases", tables=("hard_cases",))
def draw_hard_cases(hard_cases) -> Figure:
    """Draw cases (rows) and models (columns), one matrix for families that share models.

    A cross marks an outcome that was not declared.

    hard_cases : the table of this name
    """
    tables = [[hard_cases[hard_cases["family"].isin(families)] for families in column] for column in COLUMNS]
    tables = [[table for table in column if len(table)] for column in tables]
    model_counts = [max((table["model"].nunique() for table in column), default=0) for column in tables]
    heights = [sum(_above(table) + CELL * table["case"].nunique() for table in column) for column in tables]
    width, height = max(sum(LEFT + CELL * count + 0.2 for count in model_counts if count), 6.5), max(heights) + BELOW
    figure, left = Figure(figsize=(width, height)), 0.0
    for column, count in zip(tables, model_counts, strict=True):
        top = height
        for table in column:
            rows, columns = CELL * table["case"].nunique(), CELL * table["model"].nunique()
            top -= _above(table) + rows
            _matrix(figure.add_axes(((left + LEFT) / width, top / height, columns / width, rows / height)), table)
        left += LEFT + CELL * count + 0.2 if count else 0.0
    figure.legend(handles=_handles(), loc="lower left", ncols=3, bbox_to_anchor=(0.01, 0.0))
    return figure


def _above(table) -> float:
    """Return the height [inch] that the names of the models need above their matrix."""
    return 0.45 + LETTER * max((len(look(model).label) for model in table["model"]), default=0)


def _handles() -> list[Line2D]:
    handles = []
    for shown in LOOKS.values():
        label = f"{shown.marker}: {shown.label}" if shown.marker else shown.label
        handles.append(Line2D([], [], ls="", marker="s", ms=8, color=shown.colour, label=label))
    return [*handles, Line2D([], [], ls="", marker="x", ms=7, mew=1.6, color=style.INK, label="not as declared")]


def _matrix(axis, table) -> None:
    """Draw the outcomes of cases (rows) with models (columns) as coloured cells, with a line between families."""
    cases, models = list(dict.fromkeys(table["case"])), list(dict.fromkeys(table["model"]))
    for row in table.itertuples():
        x, y = models.index(row.model), cases.index(row.case)
        shown = LOOKS[row.outcome]
        axis.fill([x, x + 1, x + 1, x], [y, y, y + 1, y + 1], color=shown.colour, ec="white", lw=1.0)
        sign_colour = "white" if row.outcome in ("wrong", "nan") else style.INK
        axis.text(x + 0.5, y + 0.54, shown.marker, ha="center", va="center", fontsize=6.5, color=sign_colour)
        if not row.passed:
            axis.plot(x + 0.5, y + 0.5, "x", color=sign_colour, ms=8, mew=1.6)
    families = table.drop_duplicates("case")["family"].to_numpy()
    for edge in np.flatnonzero(families[1:] != families[:-1]) + 1:
        axis.axhline(edge, color=style.INK, lw=0.8)
    for family in dict.fromkeys(families):
        first_row = int(np.argmax(families == family))
        axis.annotate(
            TITLES.get(family, family), (0, first_row), (-150, 0), textcoords="offset points", va="top", ha="left",
            fontsize=8, fontweight="bold", rotation=90, annotation_clip=False, rotation_mode="default",
        )  # fmt: skip
    axis.set(xlim=(0, len(models)), ylim=(len(cases), 0))
    axis.set_xticks(np.arange(len(models)) + 0.5, [look(m).label for m in models], rotation=90)
    axis.set_yticks(np.arange(len(cases)) + 0.5, [spaced(case) for case in cases])
    axis.tick_params(length=0, labelsize=7, labeltop=True, labelbottom=False)
    axis.grid(False)
    axis.spines[:].set_visible(False)
