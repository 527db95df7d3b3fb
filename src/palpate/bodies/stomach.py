"""Stomach: a solid bent like a J that tapers, of a shape that no paper of this project uses."""

import numpy as np

from palpate.bodies.mesh import TetMesh
from palpate.bodies.smooth_shape import coarse_body

BEND = 2.0
"""Angle [rad] by which the axis turns from the body of the stomach to its outlet."""
STEPS = 2001


def stomach(length_m: float) -> TetMesh:
    """Build a stomach, filled, ``length_m`` long with 140 nodes and 276 triangles on its surface, always the same.

    Axes as in CT: x to the patient's left, y to the back, z to the head; the origin is the middle of the bounding box
    of the smooth shape. The wide upper end, the fundus, is at the patient's left, the narrow outlet at the right.
    """
    return coarse_body(stomach_shape, length_m)


def stomach_shape(sphere: np.ndarray) -> np.ndarray:
    """Map points of the unit sphere, (n, 3), smoothly and one to one onto a stomach about 2 long, (n, 3).

    The coefficients are ours, set by eye: round sections around an axis that goes down, then turns to the right and up.
    """
    x, y, along = sphere.T
    # the axis, by the trapezoidal rule, and how it turns
    places = np.linspace(-1.0, 1.0, STEPS)
    turn = BEND * _smooth((places + 0.35) / 1.1)
    ways = 1.25 * np.column_stack([-np.sin(turn), -np.cos(turn)])
    axis = np.cumsum((ways[1:] + ways[:-1]) / 2 * (places[1] - places[0]), axis=0)
    axis = np.vstack([np.zeros(2), axis])
    angle = np.interp(along, places, turn)
    blunt = (1.0001 - along * along) ** -0.12
    radius = (0.37 - 0.13 * along - 0.06 * along**2) * blunt
    middle = [np.interp(along, places, axis[:, i]) for i in range(2)]
    left = middle[0] + radius * x * np.cos(angle)
    head = middle[1] - radius * x * np.sin(angle)
    return np.column_stack([left, -0.85 * radius * y, head])


def _smooth(value: np.ndarray) -> np.ndarray:
    """Return a step from 0 to 1 without a kink over values from 0 to 1."""
    value = np.clip(value, 0.0, 1.0)
    return value**3 * (10 - 15 * value + 6 * value * value)
