"""Read the presses that a page asks for; whatever else was sent is refused in one sentence."""

import json
from typing import Any, NamedTuple

import numpy as np

from palpate.errors import InputError

MOST_PRESSES = 4
"""Presses at once: two hands have four fingers to spare."""
ROUNDING = 1e-3
"""What the sum of weights may differ from 1, as it was rounded on its way."""


class Asked(NamedTuple):
    """One press: a triangle of the surface at rest, weights (3,) of its corners, force (3,) [N] or way (3,) [m]."""

    triangle: int
    weights: np.ndarray
    force: np.ndarray | None
    moved: np.ndarray | None


class Bounds(NamedTuple):
    """Limit presses of a body: its number of triangles, the largest force [N] and way [m]."""

    triangles: int
    force: float
    moved: float


def read_presses(body: bytes, bounds: Bounds) -> list[Asked]:
    """Read ``{"presses": [...]}``; InputError for anything else."""
    try:
        sent = json.loads(body)
        if set(sent) != {"presses"} or not isinstance(sent["presses"], list):
            raise TypeError
        presses = [_press(each, bounds) for each in sent["presses"]]
    except InputError:
        raise
    except (ValueError, TypeError, OverflowError, RecursionError):
        raise InputError('post {"presses": [...]}, each with triangle, weights, and force or moved.') from None
    if not 1 <= len(presses) <= MOST_PRESSES:
        raise InputError(f"there are {len(presses)} presses; post 1 to {MOST_PRESSES}.")
    return presses


def _press(sent: Any, bounds: Bounds) -> Asked:
    name = "force" if "force" in sent else "moved"
    if set(sent) != {"triangle", "weights", name} or type(sent["triangle"]) is not int:
        raise TypeError
    weights, way = (np.array(sent[key], dtype=float) for key in ("weights", name))
    if weights.shape != (3,) or way.shape != (3,):
        raise TypeError
    if not 0 <= sent["triangle"] < bounds.triangles:
        raise InputError(f"a press is on no triangle of the body; give a number from 0 to {bounds.triangles - 1}.")
    # comparisons that NaN fails
    if not (weights.min() >= -ROUNDING and abs(weights.sum() - 1.0) <= ROUNDING):
        raise InputError("weights of a press are not three shares whose sum is 1.")
    most = bounds.force if name == "force" else bounds.moved
    if not (np.abs(way).max() < 1e9 and np.linalg.norm(way) <= most):
        raise InputError(f"{name} of a press is larger than this body can bear; give {most:.2g} at most.")
    weights = weights.clip(0.0)
    return Asked(sent["triangle"], weights / weights.sum(), *((way, None) if name == "force" else (None, way)))
