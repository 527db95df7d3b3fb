"""Errors of models beside a measured body: a row a model and setting, a panel a case and quantity."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from palpate.report import style, tables
from palpate.report.model_looks import law_look, look
from palpate.report.words import percent, spaced
from palpate.studies.measured.predict import GIVEN

QUANTITIES = {"sink_m": "place", "frequency_hz": "frequency", "damping_ratio": "damping", "creep_m": "creep"}
"""The quantities that are drawn, and the titles of their panels."""
WIDE, BAND = "#f1f4f7", "#d5e1ec"
ROW = 0.19  # [inch]


@style.figure("measured", tables=("measured",))
def draw_measured(measured, *, scene: str) -> Figure:
    """Draw every model's errors in one experiment, on a dark band as wide as repeats differ, a light of uncertainty.

    measured : the table of this name; scene : the experiment. Cases that nobody measured have no errors, and no panels.
    """
    rows = tables.where(measured, experiment=scene)
    rows = rows[rows["marker"].isin(["all"]) & rows["quantity"].isin(QUANTITIES)]
    cases = list(dict.fromkeys(rows.loc[rows["measured"].notna(), "case"])) or list(dict.fromkeys(rows["case"]))[:1]
    rows = rows[rows["case"].isin(cases)]
    kinds = rows.drop_duplicates(["model", "setting"])
    kinds = kinds.sort_values("model", key=lambda names: names.map(list(dict.fromkeys(names)).index), kind="stable")
    size = (11.0, 0.9 + len(cases) * (0.75 + ROW * len(kinds)))
    figure, axes = style.panels(len(cases), len(QUANTITIES), size, sharey=True, sharex="col")
    for line, case in zip(axes, cases, strict=True):
        for axis, (quantity, title) in zip(line, QUANTITIES.items(), strict=True):
            _panel(axis, tables.where(rows, case=case, quantity=quantity), kinds)
            axis.set_title(f"{spaced(case)}: {title}", fontsize="medium")
        line[0].set_yticks(range(len(kinds)), [named(row) for row in kinds.itertuples()])
        line[0].set_ylim(len(kinds) + 0.4, -0.6)  # with room for a word below
    for axis in axes[-1]:
        axis.set_xlabel("error [%]")
    figure.legend(handles=_handles(rows), loc="outside upper center", ncols=3)
    return figure


def named(row) -> str:
    """Return the name of a model with its setting, as on the axis: "quadratic elements (P2), 1701 nodes, ν = 0.45"."""
    words = {
        "poisson": lambda value: f"ν = {value}",
        "law": lambda value: law_look(value)[0],
        "damping": lambda value: f"{value} damping",
        "step_s": lambda value: f"steps of {1e3 * float(value):g} ms",
        "creep": lambda value: "before creep",
        "prony": lambda value: "with a Prony branch",
    }
    parts = [part.partition("=") for part in row.setting.split()]
    more = [words[key](value) for key, _, value in parts if key in words]
    return ", ".join([look(row.model).label, f"{row.nodes} nodes", *more])


def _panel(axis: Axes, rows: pd.DataFrame, kinds: pd.DataFrame) -> None:
    """Draw the errors of one quantity in one case over the models; a note where nothing was measured."""
    measured = rows.dropna(subset=["measured"])
    if measured.empty:
        axis.text(0.5, 0.5, "not measured", transform=axis.transAxes, ha="center", color=style.FAINT)
        return
    repeat_range = float(np.nan_to_num(measured["repeat"].iloc[0])) / abs(float(measured["measured"].iloc[0]))
    uncertainty = 100.0 * float(np.nan_to_num(measured["uncertainty"].max()))
    axis.axvspan(-uncertainty, uncertainty, color=WIDE, lw=0, zorder=0)
    axis.axvspan(-50 * repeat_range, 50 * repeat_range, color=BAND, lw=0, zorder=0)
    axis.text(0.98, 0.01, f"repeats: {percent(repeat_range)}", transform=axis.transAxes, ha="right", color=style.FAINT)
    axis.axvline(0.0, color=style.INK, lw=0.8)
    places = {key: y for y, key in enumerate(zip(kinds["model"], kinds["setting"], strict=True))}
    for row in measured.dropna(subset=["error"]).itertuples():
        shown = look(row.model)
        face = "white" if row.calibrated == GIVEN else shown.colour
        marker = "x" if row.fitted else shown.marker
        axis.plot(100 * row.error, places[row.model, row.setting], marker, mec=shown.colour, mfc=face, ms=5.5)


def _handles(rows: pd.DataFrame) -> list:
    """Return handles: dots are white for the modulus as given and full for a fitted one, bands are uncertainties."""
    calibrated = [case for case in dict.fromkeys(rows["calibrated"]) if case != GIVEN]
    faces = {"Young's modulus as given": "white"}
    faces |= {f"fitted to {spaced(case)} alone (× what was fitted)": style.INK for case in calibrated}
    dots = [
        Line2D([], [], ls="", marker="o", mec=style.INK, ms=5.5, mfc=face, label=label) for label, face in faces.items()
    ]
    bands = {BAND: "range of the repeats", WIDE: "standard uncertainty of the measurement"}
    return [*dots, *(Patch(color=colour, label=label) for colour, label in bands.items())]
