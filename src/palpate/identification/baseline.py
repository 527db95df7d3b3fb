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
    count = _rows_before_contact(depth_m, force_n)
    if count < LEAST_ROWS:
        return None
    depth, force = depth_m[:count], force_n[:count]
    away = depth - depth.mean()
    slope = float(away @ force / (away @ away))
    zero = float(force.mean() - slope * depth.mean())
    residuals = force - zero - slope * depth
    return zero, slope, float(np.sqrt(residuals @ residuals / (count - 2) / (away @ away)))


def _rows_before_contact(depth_m: np.ndarray, force_n: np.ndarray) -> int:
    """Return how many rows of a loading (k,) are before contact, 0 where too few depths are negative."""
    if (depth_m < 0.0).sum() < LEAST_ROWS:
        return 0
    deepest = depth_m.max()
    end = int(np.argmax(depth_m > SHALLOW * deepest))
    last = min(int(np.argmax(depth_m > LATEST * deepest)), end - AFTER)
    depth, force, least, best = depth_m[:end], force_n[:end], np.inf, 0
    for count in np.unique(np.linspace(LEAST_ROWS, last, PLACES).astype(int)) if last >= LEAST_ROWS else ():
        indentation = np.clip(depth - depth[count - 1], 0.0, None)
        touches = np.arange(end) >= count
        basis = np.column_stack([np.ones(end), depth / deepest, touches, (indentation / deepest) ** 1.5])
        residuals = force - basis @ np.linalg.lstsq(basis, force, rcond=None)[0]
        if residuals @ residuals < least:
            least, best = float(residuals @ residuals), count
    # touch is noticed after it happened, so that no row after the stated first touch is before contact
    return min(best, int(np.argmax(depth_m >= 0.0)))
