"""Order the nodes as a contact sees them: nearest first, the same on every run and every machine.

Ties: distances closer together than 1e-9 of the body's size count as equal (on a symmetric mesh equal
distances differ in their last digits only). Plain ordering then goes by node number, which is arbitrary: the
same pattern round another contact need not land in the same slots. The framed ordering goes by the position
in a frame fixed to the contact's rest normal, so there it does.
"""

import numpy as np

TIE = 1e-9
"""Lengths closer than this, relative to the body's size, are equal."""


def levels(values: np.ndarray, tolerance: float) -> np.ndarray:
    """Return integers in the order of ``values``, equal where neighbours in that order are within ``tolerance``.

    Rounding to multiples of the tolerance would part equal values that straddle a boundary; gaps do not.
    """
    order = np.argsort(values, kind="stable")
    level = np.empty(len(values), dtype=np.int64)
    level[order] = np.concatenate([[0], np.cumsum(np.diff(values[order]) > tolerance)])
    return level


def nearest_first(points: np.ndarray, contact: np.ndarray, size: float) -> np.ndarray:
    """Sort the numbers of ``points`` (n, 3) [m] by distance from ``contact`` (3,) [m], ties by number; size in [m]."""
    distance = np.linalg.norm(points - contact, axis=1)
    return np.argsort(levels(distance, TIE * size), kind="stable")


def nearest_first_framed(points: np.ndarray, contact: np.ndarray, frame: np.ndarray, size: float) -> np.ndarray:
    """Sort as ``nearest_first``, but ties by the position along the frame's axes (its columns), then by number."""
    away = points - contact
    distance = np.linalg.norm(away, axis=1)
    keys = [levels(values, TIE * size) for values in (distance, *(away @ frame).T)]
    return np.lexsort(keys[::-1])


def body_axis(points: np.ndarray) -> np.ndarray:
    """Find the principal axis, (3,), that stands apart most in the spread of ``points`` (n, 3); z if none does.

    On a body of revolution it is the axis of it, whether the body is long or flat. Its largest component is
    positive. The other two axes are not used: on such a body rounding alone decides where they point.
    """
    centred = points - points.mean(axis=0)
    spread, axes = np.linalg.eigh(centred.T @ centred)
    low, high = np.diff(spread)
    if max(low, high) < 1e-6 * spread[2]:
        return np.array([0.0, 0.0, 1.0])
    axis = axes[:, 2] if high >= low else axes[:, 0]
    return axis * np.sign(axis[np.abs(axis).argmax()])


def contact_frame(normal: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Build the frame of a contact: right-handed orthonormal columns (normal, tangent, binormal).

    The tangent is the first of ``directions`` (unit rows), and then of x, y and z, that leans by more than 6°
    from the normal, projected into the tangent plane. With directions that turn with the body, frames of
    contacts that a turn of the body carries into each other are turned copies of each other.
    """
    tangents = np.vstack([directions, np.eye(3)])
    tangents = tangents - np.outer(tangents @ normal, normal)
    lengths = np.linalg.norm(tangents, axis=1)
    chosen = np.argmax(lengths > 0.1)
    tangent = tangents[chosen] / lengths[chosen]
    return np.column_stack([normal, tangent, np.cross(normal, tangent)])
