"""Style of all figures: fonts, colours of effects, grids of pictures, and files that repeat byte for byte."""

from collections.abc import Sequence
from functools import wraps
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from palpate.files import write_whole

STYLE: dict[Any, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 9,
    "axes.titlesize": 9,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#444444",
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e6e6e6",
    "grid.linewidth": 0.6,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "legend.fontsize": 8,
    "legend.frameon": False,
    "lines.linewidth": 1.5,
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    "savefig.dpi": 160,
    "svg.hashsalt": "palpate",
    "svg.fonttype": "path",
}

DISPLACEMENT = "YlGnBu"
ERROR = "YlOrRd"
INK, FAINT = "#222222", "#9a9a9a"
HUES = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8b0000", "#708090")
"""Of things that have no colour of their own, in turn."""


# One hue for elastic effects, another for loads and contact, a third for damping
_ELASTIC = ("corotational", "stable_neo_hookean", "neo_hookean", "st_venant_kirchhoff", "exponential", "own_law")
EFFECTS = dict.fromkeys((*_ELASTIC, "triangles", "springs", "shape_matching"), "#009e73") | {
    "bending": "#66c2a5",
    "volume": "#00664a",
    "body_springs": "#8cc63f",
    "gravity": "#8a3c00",
    "push": "#d55e00",
    "hooks": "#f0a35e",
    "threads": "#a64b00",
    "cut": "#c2003f",
    "contact": "#e69f00",
    "held": "#b5a58c",
    "bed": "#d9ccb4",
    "rayleigh": "#b8578f",
    "kelvin": "#cc79a7",
    "maxwell": "#7a3b63",
    "velocity_damping": "#e3b1cd",
    "plasticity": "#3b3b8f",
    "prony": "#8f6bb5",
    "kinetic": "#0072b2",
    "outer_work": "#d55e00",
    "integrator": "#bdbdbd",
}
"""The colour of every effect, and of energies and costs outside effects."""

_OWN_EFFECTS = ("#8b0000", "#5f9ea0", "#bc8f00", "#4b0082", "#708090")


def effect_colour(effect: str) -> str:
    """Return the colour of an effect; for a user's own effect one of five colours, always the same."""
    return EFFECTS.get(effect) or _OWN_EFFECTS[sum(effect.encode()) % len(_OWN_EFFECTS)]


def styled(draw):
    """Run a drawing function under STYLE, leaving the caller's matplotlib settings as they were."""

    @wraps(draw)
    def inside(*args, **kwargs):
        with matplotlib.rc_context(STYLE):
            return draw(*args, **kwargs)

    return inside


def figure(name: str, tables: Sequence[str] = ()):
    """Declare the function that draws the figure ``name`` from ``tables``, in that order, and run it under STYLE.

    Arguments are literal, as ``declared.figures`` reads them. A figure of other data than tables is drawn by a rule of
    its own.
    """
    return styled


def plain_log(*axes) -> None:
    """Label logarithmic x- or y-axes with plain numbers: decades, or 1, 2, 5 where there are few decades.

    Call it after the limits are set.
    """
    for axis in axes:
        least, most = axis.get_view_interval()
        axis.set_major_locator(LogLocator(subs=(1, 2, 5) if most < 60 * least else (1,)))
        axis.set_major_formatter("{x:g}")
        axis.set_minor_formatter(NullFormatter())


def panels(rows: int, columns: int, size: tuple[float, float], **shared: Any) -> tuple[Figure, Any]:
    """Make a figure of ``size`` [inch] with (rows, columns) panels; shared : as ``Figure.subplots`` has it."""
    figure = Figure(figsize=size, layout="constrained")
    return figure, figure.subplots(rows, columns, squeeze=False, **shared)


def panel_each(
    names: Sequence[str], most: int, width: float, height: float, upright: str = "", **shared: Any
) -> tuple[Figure, dict[str, Axes]]:
    """Make a figure with a panel of ``width`` and ``height`` [inch] for each name, in rows of at most ``most``.

    upright : what the y-axes show, if all show the same, said beside the first of each row
    """
    columns = min(most, len(names))
    rows = -(-len(names) // columns)
    figure, grid = panels(rows, columns, (width * columns, height * rows + 0.5), **shared)
    for axis in grid.ravel()[len(names) :]:
        axis.remove()
    for axis in grid[:, 0] if upright else ():
        axis.set_ylabel(upright)
    return figure, dict(zip(names, grid.ravel(), strict=False))


def with_power(name: str, power: float) -> str:
    """Return the label of a curve that grows with the power of n that was fitted to it; the name if none was."""
    return f"{name}: n$^{{{power:.2f}}}$" if np.isfinite(power) else name


@styled
def save(figure: Figure, stem: str | Path) -> None:
    """Write ``stem``.png and ``stem``.svg, each under a temporary name first, then renamed.

    Neither carries a date or a program version, so the same figure gives the same bytes.
    """
    stem = Path(stem)
    for suffix, metadata in {"png": {"Software": None}, "svg": {"Date": None, "Creator": None}}.items():
        with write_whole(stem.with_name(f"{stem.name}.{suffix}")) as temporary:
            figure.savefig(temporary, format=suffix, metadata=metadata)
        figure.set_layout_engine("none")  # the places of the axes are found, which takes most of the time


_SIDE, _TITLE, _CAPTION, _BAR = 0.35, 0.5, 0.4, 0.6  # [inch] left of, above, below each picture, below all
_SPARE = 0.15  # [inch] of the last caption's space that one line leaves free
_GAP = 0.05  # of a picture's width, between pictures


def grid(
    rows: int, columns: int, aspect: float, inches: float, bare: bool = False, caption: float = _CAPTION
) -> tuple[Figure, np.ndarray]:
    """Make a figure with (rows, columns) axes for pictures, each ``inches`` wide and ``inches``/``aspect`` high.

    Unless ``bare``, there is space for titles of two lines above and for ``colour_bar`` below.
    caption : space below each picture [inch]
    """
    row_height = inches / aspect + caption
    title = 0.1 if bare else _TITLE
    height = title + rows * row_height + (-_SPARE if bare else _BAR)
    width = _SIDE + inches * columns
    figure = Figure(figsize=(width, height))
    axes = np.empty((rows, columns), dtype=object)
    for r in range(rows):
        for c in range(columns):
            left = (_SIDE + inches * (c + _GAP / 2)) / width
            bottom = 1 - (title + (r + 1) * row_height - caption) / height
            size = (inches * (1 - _GAP) / width, inches / aspect / height)
            axes[r, c] = figure.add_axes((left, bottom, *size))
            axes[r, c].set(xticks=[], yticks=[])
            axes[r, c].spines[:].set_visible(False)
    return figure, axes


def place(axis: Axes, picture: np.ndarray, caption: str) -> None:
    """Put a picture (height, width, 3) and its caption into one of the grid's axes."""
    axis.imshow(picture, interpolation="none")
    axis.set_xlabel(caption, fontsize=8, color=INK)


def outline(axis: Axes, picture: np.ndarray) -> None:
    """Draw the outline of the object that a picture shows on white."""
    axis.contour((picture.min(axis=2) < 250).astype(float), [0.5], colors=FAINT, linewidths=0.7)


def colour_bar(figure: Figure, norm, cmap, label: str, **options) -> None:
    """Draw a horizontal colour bar below the grid."""
    height = figure.get_figheight()
    axis = figure.add_axes((0.3, 0.48 / height, 0.4, 0.12 / height))
    figure.colorbar(ScalarMappable(norm, cmap), cax=axis, orientation="horizontal", label=label, **options)
