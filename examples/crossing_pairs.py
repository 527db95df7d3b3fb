"""Find the triangles of two spheres that cross, by two trees, and the curve in which the spheres meet."""

import sys

import draw
import numpy as np

from palpate.bodies.surfaces.remesh import fibonacci_sphere, triangulate
from palpate.collision import Tree, crossing_pairs, crossing_segments


def main(picture=None):
    """Return how many pairs cross, and the length of their curve over that of the circle of two true spheres."""
    one = 0.05 * fibonacci_sphere(500)  # points (n, 3) [m]
    other, triangles = one + np.array([0.06, 0.0, 0.0]), triangulate(one)

    tree, moved = Tree(one, triangles), Tree(one, triangles)
    moved.refit(other)  # cheap: the same tree around points that have moved
    pairs, _ = crossing_pairs(tree, moved)  # exact: none is missed, none is made up
    _, segments = crossing_segments(one[triangles[pairs[:, 0]]], other[triangles[pairs[:, 1]]])
    length = np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1).sum()

    if picture:
        nets = [(points, triangles, {"style": "wireframe", "color": "#b0b0b0"}) for points in (one, other)]
        met = [triangles[np.unique(side)] for side in pairs.T]
        bands = [(one, met[0], {"color": "#2a78b5"}), (other, met[1], {"color": "#e9a13b"})]
        draw.surfaces(picture, nets + bands, lines=segments)
    return len(pairs), length / (2 * np.pi * np.sqrt(0.05**2 - 0.03**2))


if __name__ == "__main__":
    count, length = main(*sys.argv[1:])
    print(f"{count} pairs cross, in a curve {length:.4f} times as long as the true circle")
