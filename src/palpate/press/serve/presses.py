"""Read the presses that a page asks for; whatever else was sent is refused in one sentence."""

import json
import math
from typing import Any, NamedTuple

import numpy as np

from palpate.errors import InputError

MOST = 4
"""Presses at once: two hands have four fingers to spare."""
TOGETHER = 1e-3
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
        sent = json.loads(body.decode("utf-8"), parse_constant=_refuse)
    except (ValueError, RecursionError):
        raise InputError("this is no JSON in UTF-8; post presses.") from None
    if not isinstance(sent, dict) or set(sent) != {"presses"} or not isinstance(sent["presses"], list):
        raise InputError('this has no list of presses; post {"presses": [...]}.')
    if not 1 <= len(sent["presses"]) <= MOST:
        raise InputError(f"there are {len(sent['presses'])} presses; post 1 to {MOST}.")
    return [_press(each, bounds) for each in sent["presses"]]


def _press(sent: Any, bounds: Bounds) -> Asked:
    if not isinstance(sent, dict) or set(sent) not in ({"triangle", "weights", way} for way in ("force", "moved")):
        raise InputError("a press has other keys than triangle, weights, and one of force and moved.")
    triangle = sent["triangle"]
    if not isinstance(triangle, int) or isinstance(triangle, bool) or not 0 <= triangle < bounds.triangles:
        raise InputError(f"a press is on no triangle of the body; give a number from 0 to {bounds.triangles - 1}.")
    weights = _three(sent["weights"], "weights")
    if weights.min() < -TOGETHER or abs(weights.sum() - 1.0) > TOGETHER:
        raise InputError("weights of a press are not three shares whose sum is 1.")
    weights = weights.clip(0.0)
    name = "force" if "force" in sent else "moved"
    way = _three(sent[name], name)
    most = bounds.force if name == "force" else bounds.moved
    if np.linalg.norm(way) > most:
        raise InputError(f"{name} of a press is larger than this body can bear; give {most:.2g} at most.")
    return Asked(triangle, weights / weights.sum(), *((way, None) if name == "force" else (None, way)))


def _three(sent: Any, name: str) -> np.ndarray:
    if not isinstance(sent, list) or len(sent) != 3 or not all(_is_number(value) for value in sent):
        raise InputError(f"{name} of a press are not three numbers.")
    return np.array(sent, dtype=float)


def _is_number(value: Any) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return math.isfinite(float(value)) and abs(float(value)) < 1e9
    except OverflowError:
        return False


def _refuse(name: str) -> float:
    raise ValueError(f"{name} is no number of JSON")
