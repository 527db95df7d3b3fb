"""Seconds per deformation on the paper's machine and on this one (paper 1's tables 4 and 5)."""

from matplotlib.figure import Figure
from matplotlib.patches import Patch

from palpate.report import style, tables
from palpate.report.number_format import seconds as written

TABLES = ("enrichment_timing",)


@style.styled
def draw(enrichment_timing) -> Figure:
    """Draw two bars for each method on a logarithmic scale; dots are the five deformations.

    enrichment_timing : the table of this name
    """
    timing = enrichment_timing
    names = tables.bodies(timing)
    figure = Figure(figsize=(10, 0.5 * len(set(timing["method"])) + 1.3), layout="constrained")
    for axis, body in zip(figure.subplots(1, len(names), sharex=True, squeeze=False)[0], names, strict=True):
        rows = tables.where(timing, body=body)
        low = 0.3 * timing[["mean_s", "paper_mean_s"]].min().min()
        for y, row in enumerate(rows.itertuples()):
            _bar(axis, y + 0.2, row.mean_s, low, color=style.look(row.method).colour)
            _bar(axis, y - 0.2, row.paper_mean_s, low, color="white", edgecolor="#555555", hatch="////")
            times = [getattr(row, f"d{i}_s") for i in range(1, 6)]
            axis.plot(times, [y + 0.2] * 5, "o", color="white", mec=style.INK, ms=3, mew=0.6)
        axis.set_yticks(range(len(rows)), [style.short(m).replace("\n", " ") for m in rows["method"]])
        axis.set(xscale="log", title=body, xlabel="time a deformation [s]")
        axis.set_xlim(low, 40 * timing[["mean_s", "paper_mean_s"]].max().max())
        axis.invert_yaxis()
        axis.grid(axis="y", visible=False)
    handles = [
        Patch(facecolor="white", edgecolor="#555555", hatch="////", label="the paper (its machine, 2020)"),
        Patch(facecolor="#777777", label="palpate (this machine, one core)"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=2)
    return figure


def _bar(axis, y, seconds, low, **look) -> None:
    """Draw one bar with its number at the end; none where the paper has no such row."""
    if seconds > 0:
        axis.barh(y, seconds - low, left=low, height=0.36, linewidth=0.7, **look)
        axis.annotate(written(seconds), (seconds, y), (5, 0), textcoords="offset points", va="center", fontsize=7.5)
