"""Draw the models that are worth taking on one scene, large enough to be read on a telephone."""

from matplotlib.figure import Figure

from palpate.report import style, tables
from palpate.report.model_looks import label, look
from palpate.report.number_format import percent, seconds
from palpate.report.pareto import front
from palpate.studies.tradeoff.figures.precision_panel import LEAST, milliseconds_and_percent
from palpate.studies.tradeoff.figures.scene_rows import ZERO, answers, averaged, front_rows, own_error

TABLES = ("accuracy_vs_time", "advice")
_WIDTH, _PLOT, _LINE = 3.6, 2.75, 0.17  # [inch] of the figure; height of the diagram, and of a line of text below it


@style.styled
def draw(accuracy_vs_time, advice, *, scene: str) -> Figure:
    """Draw the lasting front of one ``scene`` in colour, with its models named below, and everything else in grey.

    accuracy_vs_time, advice : the tables of these names
    """
    settings, advice = (tables.where(table, scene=scene) for table in (accuracy_vs_time, advice))
    settings = averaged(settings)
    best, own = front_rows(settings), own_error(settings)
    nothing = settings.loc[settings["model"] == ZERO, "rmse_of_peak"].mean()
    settings = answers(settings[settings["failures"] == 0])
    below = 0.48 + _LINE * (len(best) + 2)
    figure = Figure(figsize=(_WIDTH, _PLOT + below))
    height = figure.get_figheight()
    axis = figure.add_axes((0.165, below / height, 0.77, (_PLOT - 0.08) / height))
    axis.set(xscale="log", yscale="log")
    axis.set_xlabel("time of an answer [ms]", fontsize=8, labelpad=1)
    axis.set_ylabel("error [% of the peak displacement]", fontsize=8, labelpad=1)
    t, error = milliseconds_and_percent(settings)
    axis.plot(t, error, "o", color="#c9ced3", ms=3, mew=0, zorder=1)
    steps = front(t, settings["rmse_of_peak"])
    ends = [*t[steps], axis.get_xlim()[1]]
    axis.plot(ends, [*error[steps], error[steps][-1]], color=style.FAINT, lw=0.9, drawstyle="steps-post", zorder=2)
    for number, row in enumerate(best.itertuples(), start=1):
        _point(axis, number, row)
        figure.text(
            0.02, (below - 0.48 - _LINE * (number - 1)) / height, _line(number, row), fontsize=8, va="top",
            color=look(row.model).colour, fontweight="bold",
        )  # fmt: skip
    figure.text(
        0.02, (below - 0.48 - _LINE * len(best)) / height, _remark(own),
        fontsize=7.5, va="top", color="#666666",
    )  # fmt: skip
    for budget in advice["budget_ms"].dropna().unique():
        axis.axvline(budget, color="#b5b5b5", ls=":", lw=1, zorder=0)
        axis.annotate(
            f"{budget:g} ms", (budget, 0), (-1.5, 3), xycoords=("data", "axes fraction"), textcoords="offset points",
            ha="right", va="bottom", rotation=90, fontsize=7.5, color="#555555",
        )  # fmt: skip
    axis.margins(0.06)
    if nothing > 0:
        axis.axhline(100 * nothing, color=look(ZERO).colour, lw=1, ls=(0, (1, 1.5)), zorder=1)
    if own > 0:
        low = min(axis.get_ylim()[0], 60 * own)
        axis.set_ylim(low, None)
        axis.axhspan(low, 100 * own, color="#ececec", zorder=0)
    style.plain_log(axis.xaxis)
    style.plain_log(axis.yaxis)
    return figure


def _remark(own: float) -> str:
    """Explain what is drawn in grey and in red."""
    band = f"\nband: below the error of the truth itself, {percent(own)}" if own > 0 else ""
    return f"grey: other settings; red: no displacement at all{band}"


def _point(axis, number: int, row) -> None:
    """Draw a model of the front with its number."""
    place, shown = (1e3 * row.online_median_s, max(100 * row.rmse_of_peak, LEAST)), look(row.model)
    axis.plot(*place, "o", color=shown.colour, mec="white", mew=0.8, ms=11, zorder=4)
    axis.annotate(str(number), place, ha="center", va="center", fontsize=8, fontweight="bold", color="white", zorder=5)


def _line(number: int, row) -> str:
    """Name a model of the front with its error and its time."""
    return f"{number}  {label(row.model, 'default')}: {percent(row.rmse_of_peak)} in {seconds(row.online_median_s)}"
