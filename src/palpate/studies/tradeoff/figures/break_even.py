"""Number of answers after which the preparation of a model has paid."""

from textwrap import fill

import numpy as np
from matplotlib.figure import Figure

from palpate.benchmark.comparison import BY_ERROR, pick
from palpate.report import style, tables
from palpate.report.model_looks import label, look
from palpate.report.number_format import percent
from palpate.studies.tradeoff.figures.scene_rows import answers, averaged, first_split

TABLES = ("accuracy_vs_time", "advice")
ANSWERS = np.geomspace(1, 1e6, 61)
DASHES = ("-", "--", ":", "-.")
"""Line styles, one for each setting of a model."""
WIDE = 64
"""Letters in a line of the legend, about as wide as a panel."""


@style.styled
def draw(accuracy_vs_time, advice) -> Figure:
    """Draw the time of preparation and answers together, for every setting advised by RMSE; a panel per scene.

    accuracy_vs_time, advice : the tables of these names
    """
    names, advice = tables.scenes(accuracy_vs_time), tables.where(first_split(advice), error="rms")
    columns = min(2, len(names))
    taken = {
        scene: advised(tables.where(accuracy_vs_time, scene=scene), tables.where(advice, scene=scene))
        for scene in names
    }
    told = {scene: [_named(row) for row in rows.itertuples()] for scene, rows in taken.items()}
    lines, most = -(-len(names) // columns), max("\n".join(texts).count("\n") + 1 for texts in told.values())
    figure = Figure(figsize=(5 * columns, (3.1 + 0.15 * most) * lines), layout="constrained")
    panels = figure.subplots(lines, columns, squeeze=False).ravel()
    for axis, scene in zip(panels, names, strict=False):
        drawn: list[str] = []
        for row, text in zip(taken[scene].itertuples(), told[scene], strict=True):
            shown = look(row.model)
            total = row.offline_s + ANSWERS * row.online_median_s
            axis.loglog(ANSWERS, total, DASHES[drawn.count(row.model) % 4], color=shown.colour, label=text, zorder=2)
            drawn.append(row.model)
            if ANSWERS[0] <= row.break_even_queries <= ANSWERS[-1]:
                paid = row.offline_s + row.break_even_queries * row.online_median_s
                axis.plot(row.break_even_queries, paid, "o", color=shown.colour, mec="white", ms=6, zorder=3)
        axis.set(title=scene.replace("_", " "), xlabel="answers", ylabel="preparation and answers [s]")
        axis.legend(fontsize=7, loc="upper left", bbox_to_anchor=(0, -0.17), borderaxespad=0)  # no line is hidden
        style.plain_log(axis.xaxis)
        style.plain_log(axis.yaxis)
    for axis in panels[len(names) :]:
        axis.set_visible(False)
    return figure


def _named(row) -> str:
    return fill(f"{label(row.model, row.setting)}, {percent(row.rmse_of_peak)}", WIDE)


def advised(settings, advice):
    """Select the settings of one scene that are advised for any limit, and the most accurate; most accurate first."""
    means = answers(averaged(settings))
    able = means[means["failures"] == 0].set_index(["model", "setting"], drop=False)
    taken = {*zip(advice["model"], advice["setting"], strict=True), pick(able, BY_ERROR).name}
    return able[able.index.isin(taken)].sort_values("rmse_of_peak")
