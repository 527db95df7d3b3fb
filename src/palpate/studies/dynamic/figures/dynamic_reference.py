"""Change of references at each halving of the step, over time: up to when a motion is resolved."""

import matplotlib
from matplotlib.figure import Figure

from palpate.report import style, tables
from palpate.studies.dynamic.figures.panels import panels

TABLES = ("dynamic_reference",)
LEAST = 0.01
"""The lower end of the axis [%]: before the first contact, or in free fall, nothing changes."""


@style.styled
def draw(dynamic_reference) -> Figure:
    """Draw one panel for each scene, a line for each step; frames in which models are not compared are shaded.

    dynamic_reference : the table of this name
    """
    table = dynamic_reference
    figure, axes = panels(tables.scenes(table), 2.6, "change [% of peak]")
    for scene, axis in axes.items():
        rows = tables.where(table, scene=scene)
        steps = sorted(set(rows["step_s"]), reverse=True)
        shades = matplotlib.colormaps["viridis_r"]
        for number, step in enumerate(steps):
            line = rows[rows["step_s"] == step]
            colour = shades((number + 1) / len(steps))
            axis.plot(line["time_s"], 100 * line["change_of_peak"], color=colour, label=f"{1e3 * step:.2g} ms")
        axis.axhline(100 * rows["bound"].iloc[0], color=style.FAINT, ls=":", lw=1)
        until, end = rows.loc[rows["resolved"].astype(bool), "time_s"].max(), rows["time_s"].max()
        if until < end:
            axis.axvspan(until, end, color="#eeeeee", lw=0)
        axis.set(yscale="log", xlabel="time [s]")
        axis.set_title(scene.replace("_", " "))
        axis.legend(title="step", loc="lower right", fontsize=7, title_fontsize=7)
    for axis in axes.values():
        axis.set_ylim(bottom=LEAST)
        style.plain_log(axis.yaxis)
    return figure
