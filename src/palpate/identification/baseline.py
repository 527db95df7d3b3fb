"""Zero and slope of a force sensor, from the rows of presses before contact.

Contact is looked for at each row: a line, and from there on a step, as adhesion makes it, and a force with the 1.5th
power of the way, are fitted to the shallow rows; the place that leaves least counts (Rudoy and others, J. R. Stat. Soc.
C 59, 2010). The line that is subtracted is that of the rows before it.
"""

import numpy as np

LEAST_ROWS, AFTER = 5, 4
"""Fewest rows before contact that give a line, and of a press after it."""
LATEST, SHALLOW = 0.1, 0.5
"""Of the largest depth: up to where contact is looked for, and up to where rows are fitted."""
PLACES = 60
"""Most rows at which contact is looked for."""


def line_before(depth_m: np.ndarray, force_n: np.ndarray) -> tuple[float, float, float] | None:
    """Return force at depth 0 [N], slope [N/m] and its standard error of the rows (k,) of a loading before contact.

    None where too few depths are negative.
    """
    count = _rows_before(depth_m, force_n)
    if count < LEAST_ROWS:
        return None
    depth, force = depth_m[:count], force_n[:count]
    away = depth - depth.mean()
    slope = float(away @ force / (away @ away))
    zero = float(force.mean() - slope * depth.mean())
    left = force - zero - slope * depth
    return zero, slope, float(np.sqrt(left @ left / (count - 2) / (away @ away)))


def _rows_before(depth_m: np.ndarray, force_n: np.ndarray) -> int:
    if (depth_m < 0.0).sum() < LEAST_ROWS:
        return 0
    most = depth_m.max()
    end = int(np.argmax(depth_m > SHALLOW * most))
    last = min(int(np.argmax(depth_m > LATEST * most)), end - AFTER)
    depth, force, least, found = depth_m[:end], force_n[:end], np.inf, 0
    for k in np.unique(np.linspace(LEAST_ROWS, last, PLACES).astype(int)) if last >= LEAST_ROWS else ():
        way = np.clip(depth - depth[k - 1], 0.0, None)
        basis = np.column_stack([np.ones(end), depth / most, np.arange(end) >= k, (way / most) ** 1.5])
        left = force - basis @ np.linalg.lstsq(basis, force, rcond=None)[0]
        if left @ left < least:
            least, found = float(left @ left), k
    # touch is noticed after it happened, so that the stated one ends the rows, too
    return min(found, int(np.argmax(depth_m >= 0.0)))
