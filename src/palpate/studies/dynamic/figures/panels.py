"""Panels of figures that have one for each scene."""

from math import ceil

from matplotlib.axes import Axes
from matplotlib.figure import Figure

COLUMNS = 4
"""Panels in a row at most."""


def panels(scenes: list[str], height: float, upright: str) -> tuple[Figure, dict[str, Axes]]:
    """Make a figure with a panel for each scene, in as many rows as needed, of ``height`` inches each.

    upright : what all y-axes show, said beside the first of each row
    """
    columns = min(COLUMNS, len(scenes))
    rows = ceil(len(scenes) / columns)
    figure = Figure(figsize=(3.4 * columns, height * rows + 0.5), layout="constrained")
    axes = figure.subplots(rows, columns, sharey=True, squeeze=False).ravel()
    for axis in axes[len(scenes) :]:
        axis.remove()
    for axis in axes[::columns]:
        axis.set_ylabel(upright)
    return figure, dict(zip(scenes, axes, strict=False))
