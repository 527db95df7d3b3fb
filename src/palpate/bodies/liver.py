"""Liver: paper 1's second body, with its surface counts 140/276 and, refined, 554/1104 and 2210/4416."""

import numpy as np

from palpate.bodies.mesh import TetMesh
from palpate.bodies.smooth_shape import coarse_body, logistic


def liver(length_m: float) -> TetMesh:
    """Build a liver ``length_m`` long with 140 nodes and 276 triangles on its surface, identical on every call.

    Axes as in CT: x to the patient's left, y to the back, z to the head; the origin is the middle of the
    bounding box of the smooth shape.
    """
    return coarse_body(liver_shape, length_m)


def liver_shape(sphere: np.ndarray) -> np.ndarray:
    """Map points of the unit sphere, (n, 3), smoothly and one to one onto a liver about 2 long, (n, 3).

    The coefficients are ours, set by eye: cross-sections along x shrink from the thick right lobe to the thin left one.
    """
    x, y, z = sphere.T
    right = logistic(3.2 * (0.18 - x))
    blunt = (1.0001 - x * x) ** -0.12
    y, z = y * blunt, z * blunt
    under = logistic(-8 * z)
    top = 0.22 + 0.42 * right
    # the underside falls to the anterior edge and rises to the back
    bottom = (0.18 + 0.72 * right) * (1 - 0.45 * y)
    height = z * (top + (bottom - top) * under)
    depth = y * (0.40 + 0.32 * right)
    hollow = 0.42 * np.exp(-(((x - 0.1) / 0.6) ** 2) - ((y - 0.25) / 0.6) ** 2)
    heart = 0.05 * np.exp(-(((x - 0.35) / 0.3) ** 2) - (y / 0.6) ** 2)
    notch = 0.07 * np.exp(-(((x - 0.28) / 0.15) ** 2)) * logistic(-8 * (y + 0.4))
    stomach = 0.14 * np.clip(x + 0.2, 0, None) ** 2
    height = height + hollow * under * (0.3 + 0.7 * right) - heart * (1 - under)
    return np.column_stack([x, depth + notch - stomach, height + 0.25 * depth + 0.12 * x])
