"""Touches by which models without elements are calibrated, with what quadratic elements answer to them.

At a given depth a stiffness scales the force and leaves the displacement as it is, so that one factor fits it.
"""

import warnings

import numpy as np

from palpate.benchmark.touch import Touch, TouchCase, Touched, choose_touches, touches_of
from palpate.benchmark.touched_mesh import TouchedMeshes
from palpate.errors import NotConverged

COUNT, DEPTHS = 4, (0.3, 0.7)
"""Touches that serve, and their depths over the radius of the instrument, at most the deepest of the case."""
ALONG, TOLERANCE = 2.0, 1e-3
"""Elements along the radius of what touches, and the residual at which their answers stop."""
SEED = 1000
"""Added to the case's, so that the touches are not those that are asked."""


def calibration(case: TouchCase) -> list[tuple[Touch, Touched]]:
    """Return touches and the answers to them, found once for all models of a case."""
    return case.share("calibration", lambda: _answered(case))


def _answered(case: TouchCase) -> list[tuple[Touch, Touched]]:
    meshes, answers = TouchedMeshes(case.body), {}

    def bears(touch: Touch) -> bool:
        try:
            mesh = meshes.around(touch, 0, meshes.level_for(touch, ALONG))
            answers[touch.node, touch.depth_m] = mesh.answer(TOLERANCE)[0]
        except NotConverged:
            return False
        return True

    deepest = case.deepest_m / case.instrument.radius_m
    depths = min(DEPTHS[0], deepest), min(DEPTHS[1], deepest)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of places that others take
        table = choose_touches(case.body, case.instrument, COUNT, depths, case.seed + SEED, bears)
    touches = touches_of(case.instrument, table)
    return [(touch, answers[touch.node, touch.depth_m]) for touch in touches]


def force_scale(found: list[Touched], right: list[Touched]) -> float:
    """Return the factor for the forces at the whole depth that leaves the least relative errors, by least squares.

    NotConverged where no touch is felt at all.
    """
    ratios = np.array([one.force_n / other.force_n for one, other in zip(found, right, strict=True)])
    if not (np.isfinite(ratios).all() and ratios.sum() > 0.0):
        raise NotConverged("no calibrating touch is felt; take a finer level", [float("nan")])
    return float(ratios.sum() / (ratios @ ratios))
