"""Least error of springs for materials with other Poisson ratios than their own, 1/4: the floor of the model."""

from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from palpate.report import style, tables
from palpate.report.spring_looks import DASHES, FITS, FORCES

TABLES = ("spring_floor",)
OWN = 0.25
"""The Poisson ratio of a spring network (Kot and Nagahashi)."""
_MARKERS = {False: "o", True: "s"}


@style.styled
def draw(spring_floor) -> Figure:
    """Draw the error over the reference's Poisson ratio, one panel for each press, with and without the volume force.

    The springs are fitted to all presses by gradient.

    spring_floor : the table of this name
    """
    floor = spring_floor
    presses = list(dict.fromkeys(floor["press"]))
    figure = Figure(figsize=(9.5, 3.6), layout="constrained")
    axes = figure.subplots(1, len(presses), sharey=True, squeeze=False)[0]
    colour = FITS["gradient"].colour
    for axis, press in zip(axes, presses, strict=True):
        axis.axvline(OWN, color=style.FAINT, ls=":", lw=1)
        for force, marker in _MARKERS.items():
            rows = tables.where(floor, press=press, volume_force=force).sort_values("poisson")
            error = 100 * rows["rmse_of_peak"]
            axis.plot(rows["poisson"], error, marker, color=colour, ls=DASHES[force], ms=4.5, mec="white", mew=0.5)
        axis.set(title=f"{press} press", xlabel="Poisson's ratio of the reference")
    axes[0].set(ylabel="RMSE [% of peak]", ylim=(0, None))  # after all panels, as they share it
    handles = [
        Line2D([], [], color=colour, ls=DASHES[force], marker=marker, ms=4.5, label=FORCES[force])
        for force, marker in _MARKERS.items()
    ]
    handles.append(Line2D([], [], color=style.FAINT, ls=":", lw=1, label="the springs' own ratio"))
    figure.legend(handles=handles, loc="outside upper center", ncols=3)
    return figure
