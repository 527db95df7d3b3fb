"""Draw errors against time for loads that models were not prepared for, a column for each kind of load."""

import pandas as pd
from matplotlib.artist import Artist
from matplotlib.figure import Figure

from palpate.report import style, tables
from palpate.report.model_looks import label, look
from palpate.studies.tradeoff.general_loads import DEPTH, KINDS

TABLES = ("any_load",)
FORCE = "depth: the force"
"""The last column: what a disc bears that is pushed to a depth."""


@style.styled
def draw(any_load) -> Figure:
    """Draw the error of every setting over its time; a row per scene, a column for each kind of load, and the force.

    any_load : the table of this name
    Settings that answered all loads are full, others hollow. Models that refuse all of a kind are named in its panel.
    """
    scenes, columns = tables.scenes(any_load), [*KINDS, FORCE]
    figure = Figure(figsize=(2.75 * len(columns), 0.9 + 2.5 * len(scenes)), layout="constrained")
    panels = figure.subplots(len(scenes), len(columns), squeeze=False, sharex=True, sharey=True)
    for row, scene in zip(panels, scenes, strict=True):
        found = tables.where(any_load, scene=scene)
        for axis, column in zip(row, columns, strict=True):
            kind, error = (DEPTH, "force_error") if column == FORCE else (column, "rmse_of_peak")
            _panel(axis, tables.where(found, kind=kind), error)
            axis.set_title(column)
        row[0].set_ylabel(f"{scene.replace('_', ' ')}\nerror, RMSE [% of peak]")
    for axis in panels[-1]:
        axis.set_xlabel("time of an answer [ms]")
        style.plain_log(axis.xaxis)
    style.plain_log(panels[0, 0].yaxis)
    handles: dict[str, Artist] = {}
    for axis in panels.ravel():
        handles |= {text: handle for handle, text in zip(*axis.get_legend_handles_labels(), strict=True)}
    figure.legend(list(handles.values()), list(handles), loc="outside lower center", ncols=5)
    return figure


def _panel(axis, rows: pd.DataFrame, error: str) -> None:
    """Draw a line for each model, and name below those that refuse."""
    refused = []
    for name, found in rows.groupby("model", sort=False):
        shown, text = look(name), label(name, "default")
        able = found[found[error].notna()].sort_values("online_median_s")
        if (found["refused"] == found["samples"]).all():
            refused.append(text)
        if able.empty:
            continue
        times, errors = 1e3 * able["online_median_s"], 100 * able[error]
        mark = {"marker": shown.marker, "ms": 9 if shown.marker == "*" else 6, "mew": 0.4, "color": shown.colour}
        axis.loglog(times, errors, "-", lw=1, mec="white", label=text, **mark)
        partly = (able["refused"] + able["doubted"] + able["failures"] > 0).to_numpy()
        if partly.any():
            axis.loglog(times[partly], errors[partly], ls="", mfc="white", **mark | {"mew": 1.0})
    axis.set(xscale="log", yscale="log")
    if refused:
        axis.text(
            0.02, 0.02, "\n".join(["refused by", *refused]), transform=axis.transAxes, va="bottom", fontsize=6.5,
            color="#777777",
        )  # fmt: skip
