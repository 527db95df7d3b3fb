"""Scenes of bodies that are apart, for most of the time or always, in closed form."""

import numpy as np
from scipy.spatial.transform import Rotation

from palpate.studies.collision.deforming_surfaces import Moving, instrument_press, liver_surface, two_livers

FAR_M = 0.06
"""Height from which the instrument comes, and to which it returns."""
APART_M = 0.05
"""Additional distance of the livers' centres, with which they pass each other."""


def instrument_approach(refinements: int) -> Moving:
    """Make the instrument of ``instrument_press`` come from far, press for a fifth of the time, and leave again."""
    pressing = instrument_press(refinements)

    def at(time: float) -> list[np.ndarray]:
        capsule, liver = pressing.at(np.clip((time - 0.4) / 0.2, 0.0, 1.0))
        away = max(abs(time - 0.5) - 0.1, 0.0) / 0.4
        return [capsule + np.array([0.0, 0.0, FAR_M * away]), liver]

    return Moving("instrument_approach", pressing.triangles, at)


def livers_apart(refinements: int) -> Moving:
    """Make the livers of ``two_livers`` pass each other without touching."""
    meeting = two_livers(refinements)

    def at(time: float) -> list[np.ndarray]:
        one, other = meeting.at(time)
        return [one, other + np.array([APART_M, 0.0, 0.0])]

    return Moving("livers_apart", meeting.triangles, at)


def two_bodies(refinements: int) -> dict[str, tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]]:
    """Return pairs of rigid bodies to be placed apart: points (n, 3) [m] and triangles (m, 3) of both, by name."""
    liver = liver_surface(refinements)
    pressing = instrument_press(refinements)
    return {"two_livers": (liver, liver), "instrument": ((pressing.at(0.0)[0], pressing.triangles[0]), liver)}


def turned(points: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Rotate points (n, 3) [m] about their mean, evenly over all rotations, and put the mean at the origin."""
    return Rotation.random(random_state=random).apply(points - points.mean(axis=0))
