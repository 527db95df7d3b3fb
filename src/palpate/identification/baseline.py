"""Zero and slope of a force sensor, from the rows of presses before contact.

Each shallow row is tried as the one of first contact: a line, and from that row on a step, as adhesion makes it, and a
force in proportion to depth to the power of 1.5 are fitted. The row with the least residuals is taken (Rudoy and
others, J. R. Stat. Soc. C 59, 2010). The sensor's line is fitted to the rows before it.
"""

import numpy as np

LEAST_ROWS, AFTER = 5, 4
"""Fewest rows before contact that give a line, and of a press after it."""
LATEST, SHALLOW = 0.1, 0.5
"""Of the largest depth: up to where contact is looked for, and up to where rows are fitted."""
PLACES = 60
"""Most rows at which contact is looked for."""


def line_before(depth_m: np.ndarray, force_n: np.ndarray) -> tuple[float, float, float] | None:
    """Fit a line to the rows of a loading before contact: force at depth 0 [N], slope and its standard error [N/m].

    depth_m, force_n : (k,) of the loading. None where fewer than LEAST_ROWS rows are before contact.
    """
    row_count = _rows_before_contact(depth_m, force_n)
    if row_count < LEAST_ROWS:
        return None
    depth, force = depth_m[:row_count], force_n[:row_count]
    centred_depth = depth - depth.mean()
    slope = float(centred_depth @ force / (centred_depth @ centred_depth))
    zero = float(force.mean() - slope * depth.mean())
    residuals = force - zero - slope * depth
    return zero, slope, float(np.sqrt(residuals @ residuals / (row_count - 2) / (centred_depth @ centred_depth)))


def _rows_before_contact(depth_m: np.ndarray, force_n: np.ndarray) -> int:
    """Return how many rows of a loading (k,) are before contact, 0 where too few depths are negative."""
    if (depth_m < 0.0).sum() < LEAST_ROWS:
        return 0
    deepest = depth_m.max()
    end_row = int(np.argmax(depth_m > SHALLOW * deepest))
    last_row = min(int(np.argmax(depth_m > LATEST * deepest)), end_row - AFTER)
    depth, force, least_squares, best_count = depth_m[:end_row], force_n[:end_row], np.inf, 0
    for count in np.unique(np.linspace(LEAST_ROWS, last_row, PLACES).astype(int)) if last_row >= LEAST_ROWS else ():
        indentation = np.clip(depth - depth[count - 1], 0.0, None)
        touches = np.arange(end_row) >= count
        basis = np.column_stack([np.ones(end_row), depth / deepest, touches, (indentation / deepest) ** 1.5])
        residuals = force - basis @ np.linalg.lstsq(basis, force, rcond=None)[0]
        if residuals @ residuals < least_squares:
            least_squares, best_count = float(residuals @ residuals), count
    # touch is noticed after it happened, so that no row after the stated first touch is before contact
    return min(best_count, int(np.argmax(depth_m >= 0.0)))
