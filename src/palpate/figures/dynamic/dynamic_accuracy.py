"""Error of motion over its cost: a work–precision diagram for each scene, a curve for each model over its step."""

from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from palpate.figures import style, tables
from palpate.figures.model_looks import look

TABLES = ("dynamic_accuracy",)


@style.styled
def draw(dynamic_accuracy) -> Figure:
    """Draw one panel for each scene; settings that did not converge are counted in the panel's title.

    dynamic_accuracy : the table of this name
    """
    table = dynamic_accuracy
    scenes, models = tables.scenes(table), list(dict.fromkeys(table["model"]))
    figure = Figure(figsize=(3.5 * len(scenes), 4.0), layout="constrained")
    axes = figure.subplots(1, len(scenes), sharey=True, squeeze=False)[0]
    for axis, scene in zip(axes, scenes, strict=True):
        rows = tables.where(table, scene=scene)
        for model in models:
            kept = rows[(rows["model"] == model) & (rows["failures"] == 0)].sort_values("real_time_factor")
            style_of = {"marker": look(model).marker, "color": look(model).colour, "ms": 5, "mec": "white", "mew": 0.5}
            axis.plot(kept["real_time_factor"], 100 * kept["rmse_of_peak"], **style_of)
        axis.axvline(1.0, color=style.FAINT, lw=1)
        axis.axhline(100 * rows["reference_change"].iloc[0], color=style.FAINT, ls=":", lw=1)
        failed = int(rows["failures"].sum())
        axis.set(xscale="log", yscale="log", xlabel="seconds for a second of motion")
        axis.set_title(scene.replace("_", " ") + (f", {failed} did not converge" if failed else ""))
    axes[0].set_ylabel("RMSE [% of peak]")
    for axis in axes:
        style.plain_log(axis.xaxis)
        style.plain_log(axis.yaxis)
    handles = [Line2D([], [], color=look(m).colour, marker=look(m).marker, ms=5, label=look(m).label) for m in models]
    figure.legend(handles=handles, loc="outside upper center", ncols=5)
    return figure
