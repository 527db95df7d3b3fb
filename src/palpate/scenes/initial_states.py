"""Initial states of scenes: at rest, or in a state that a real body is never in."""

import numpy as np

from palpate.bodies.particles import Particles

STARTS = ("rest", "inverted", "random", "plane", "line", "point")


def initial_positions(particles: Particles, free: np.ndarray, kind: str, seed: int) -> np.ndarray:
    """Return the positions (n, 3) [m] at time zero; nodes that are not ``free``, (n,) bool, are at rest in any case.

    inverted : mirrored at the middle of the first axis
    random : uniform in a cube of the body's size around its middle
    plane, line, point : flattened to the middle along one, two or all axes
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
