"""Time and memory of each component over its size."""

import numpy as np
from matplotlib.figure import Figure

from palpate.report import style, tables
from palpate.studies.scaling.measure_scaling import LEAST_MB

COMPONENTS = {
    "fem": ("finite elements", "#111111", "8"),
    "fine_nodes": ("enrichment, fine nodes", "#d55e00", "o"),
    "samples": ("enrichment, samples", "#ee8742", "s"),
    "triangles": ("composite trees", "#0072b2", "^"),
    "particles": ("shape matching", "#009e73", "D"),
    "cores": ("genetic algorithm", "#b8578f", "v"),
}
"""Title, colour and marker of each component."""
_STAGES = ("#111111", "#d55e00", "#0072b2", "#009e73")


@style.figure("scaling", tables=("scaling",))
def draw_scaling(scaling) -> Figure:
    """Draw one panel for each component, one curve with its exponent for each stage, and memory in the last panel."""
    components = [component for component in COMPONENTS if (scaling["component"] == component).any()]
    figure, grid = style.panels(2, 4, (12, 6.6))
    panels = grid.ravel()
    for axis, component in zip(panels, components, strict=False):
        _times(axis, component, tables.where(scaling, component=component))
    _memory(panels[len(COMPONENTS)], scaling, [component for component in components if component != "cores"])
    for axis in panels:
        axis.set_axis_on() if axis.lines else axis.set_axis_off()  # off for missing components
    for axis in panels[::4]:
        axis.set_ylabel("time [s]")
    return figure


def _times(axis, component: str, rows) -> None:
    """Draw the stages of one component; dotted: proportional to the size, or for cores the ideal speed-up."""
    for (stage, of_stage), colour in zip(rows.groupby("stage", sort=False), _STAGES, strict=False):
        label = style.with_power(stage, of_stage["seconds_exponent"].iloc[0])
        axis.loglog(of_stage["size"], of_stage["seconds"], "o-", ms=4, lw=1.2, color=colour, label=label)
    sizes = np.array([rows["size"].min(), rows["size"].max()], dtype=float)
    first_s, last_s = (tables.where(rows, size=size)["seconds"].max() for size in sizes)
    ideal = first_s / sizes if component == "cores" else last_s * sizes / sizes[-1]
    axis.loglog(sizes, ideal, color=style.FAINT, lw=0.9, ls=":", zorder=1)
    axis.set(title=COMPONENTS[component][0], xlabel=f"{rows['unit'].iloc[0]}, n")
    _finish(axis)


def _memory(axis, scaling, components: list[str]) -> None:
    """Draw the largest memory [MB] of all stages of each component over the size, where it is at least LEAST_MB."""
    for component in components:
        rows = tables.where(scaling, component=component)
        exponent = rows.loc[rows["memory_mb"].idxmax(), "memory_exponent"]
        largest_mb = rows.groupby("size")["memory_mb"].max()
        largest_mb = largest_mb[largest_mb >= LEAST_MB]
        title, colour, marker = COMPONENTS[component]
        if len(largest_mb):
            label = style.with_power(title, exponent)
            axis.loglog(largest_mb.index, largest_mb, marker=marker, ms=4, lw=1.2, color=colour, label=label)
    axis.set(title="memory", xlabel="size, n", ylabel="[MB]")
    if axis.lines:
        _finish(axis)


def _finish(axis) -> None:
    axis.legend(loc="upper left", fontsize=7.5)
    bottom, top = axis.get_ylim()
    axis.set_ylim(bottom, top * (top / bottom) ** 0.45)  # room for the legend
    style.plain_log(axis.xaxis, axis.yaxis)
