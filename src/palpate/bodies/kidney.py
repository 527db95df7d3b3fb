"""Kidney: a bean, of a shape that no paper of this project uses, for answers that rest on more than two bodies."""

import numpy as np

from palpate.bodies.mesh import TetMesh
from palpate.bodies.smooth_shape import coarse_body


def kidney(length_m: float) -> TetMesh:
    """Build a left kidney ``length_m`` long with 140 nodes and 276 triangles on its surface, identical on every call.

    Axes as in CT: x to the patient's left, where it bulges, y to the back, z to the head; the origin is the middle of
    the bounding box of the smooth shape.
    """
    return coarse_body(kidney_shape, length_m)


def kidney_shape(sphere: np.ndarray) -> np.ndarray:
    """Map points of the unit sphere, (n, 3), smoothly and one to one onto a kidney about 2 long, (n, 3).

    The coefficients are ours, set by eye: poles bent towards the hilum, which is a hollow in the middle side.
    """
    x, y, z = sphere.T
    blunt = (1.0001 - z * z) ** -0.1
    hilum = 0.2 * np.exp(-((z / 0.4) ** 2) - (y / 0.7) ** 2) * (1 - x) / 2
    across = (0.5 - 0.04 * z) * x * blunt + hilum
    return np.column_stack([across - 0.28 * z * z, 0.4 * y * blunt, z])
