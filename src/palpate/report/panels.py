"""A grid of pictures of one size with a caption below each, and space for a colour bar."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure

from palpate.report import style

_SIDE, _TITLE, _CAPTION, _BAR = 0.35, 0.5, 0.4, 0.6  # [inch] left of, above, below each picture, below all
_SPARE = 0.15  # [inch] of the last caption's space that one line leaves free
_GAP = 0.05  # of a picture's width, between pictures


def grid(rows: int, columns: int, aspect: float, inches: float, bare: bool = False) -> tuple[Figure, np.ndarray]:
    """Make a figure with (rows, columns) axes for pictures ``inches`` wide and ``inches``/``aspect`` high.

    Unless ``bare``, there is space for titles of two lines above and for ``colour_bar`` below.
    """
    row = inches / aspect + _CAPTION
    title = 0.1 if bare else _TITLE
    height = title + rows * row + (-_SPARE if bare else _BAR)
    width = _SIDE + inches * columns
    figure = Figure(figsize=(width, height))
    axes = np.empty((rows, columns), dtype=object)
    for r in range(rows):
        for c in range(columns):
            left = (_SIDE + inches * (c + _GAP / 2)) / width
            bottom = 1 - (title + (r + 1) * row - _CAPTION) / height
            size = (inches * (1 - _GAP) / width, inches / aspect / height)
            axes[r, c] = figure.add_axes((left, bottom, *size))
            axes[r, c].set(xticks=[], yticks=[])
            axes[r, c].spines[:].set_visible(False)
    return figure, axes


def place(axis: Axes, picture: np.ndarray, caption: str) -> None:
    """Put a picture (height, width, 3) and its caption into one of the grid's axes."""
    axis.imshow(picture, interpolation="none")
    axis.set_xlabel(caption, fontsize=8, color=style.INK)


def outline(axis: Axes, picture: np.ndarray) -> None:
    """Draw the outline of the object that a picture shows on white."""
    axis.contour((picture.min(axis=2) < 250).astype(float), [0.5], colors=style.FAINT, linewidths=0.7)


def colour_bar(figure: Figure, norm, cmap, label: str, **options) -> None:
    """Draw a horizontal colour bar below the grid."""
    height = figure.get_figheight()
    axis = figure.add_axes((0.3, 0.48 / height, 0.4, 0.12 / height))
    figure.colorbar(ScalarMappable(norm, cmap), cax=axis, orientation="horizontal", label=label, **options)
