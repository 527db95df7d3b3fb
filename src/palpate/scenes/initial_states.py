"""Where a scene begins: at rest, or in a state that no good body should ever be in."""

import numpy as np

from palpate.bodies.particles import Particles

STARTS = ("rest", "inverted", "random", "plane", "line", "point")


def start_of(particles: Particles, free: np.ndarray, kind: str, seed: int) -> np.ndarray:
    """Positions (n, 3) [m] at time zero; nodes that are not ``free``, (n,) bool, start at rest in any case.

    inverted : mirrored in the middle of the first axis; random : evenly anywhere in a cube of the body's size
    around its middle; plane, line, point : the body pressed flat, to a thread, to a dot
    """
    rest = particles.nodes
    middle = rest.mean(axis=0)
    flat = {"plane": [1, 1, 0], "line": [1, 0, 0], "point": [0, 0, 0], "inverted": [-1, 1, 1], "rest": [1, 1, 1]}
    if kind == "random":
        half = particles.size / 2
        x = middle + np.random.default_rng(seed).uniform(-half, half, rest.shape)
    else:
        x = middle + (rest - middle) * flat[kind]
    x[~free] = rest[~free]
    return rest.copy() if kind == "rest" else x
