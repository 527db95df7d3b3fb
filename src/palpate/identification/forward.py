"""What a forward model of pressed tissue offers to a fit, and the one of a ball on a bonded slab or a half-space.

Forces are those of a tissue with Young's modulus 1 Pa: all laws are proportional to it, so that a fit multiplies them.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple, Protocol

import numpy as np

from palpate.identification.curves import CurveFamily, Ranges, family_of

Range = float | tuple[float, float]
"""A value that is known, or the least and greatest that one may have."""


class Parameter(NamedTuple):
    """What a forward model does not know by itself: its name, the range that the model holds in, and its unit."""

    name: str
    low: float
    high: float
    unit: str


class Forward(Protocol):
    """Gives the forces of presses from parameters.

    parameters : any of poisson, stiffening, thickness_m, sticking (0 slips to 1 sticks)
    relative_error : of force, as measured against the truth of touch, a standard deviation as a share
    deepest_m : no depth may be larger [m]
    """

    parameters: tuple[Parameter, ...]
    relative_error: float
    deepest_m: float

    def forces(self, press: int, depth_m: np.ndarray, values: Mapping[str, float]) -> np.ndarray:
        """Return the forces (k,) [N] of press number ``press`` at ``depth_m`` (k,) [m] for young_pa = 1.

        values : of each of ``parameters``. Smooth in depth and values, increasing with depth, 0 for depths below 0.
        InputError for a depth above ``deepest_m`` or a value outside its range.
        """
        ...


class SlabForward:
    """A ball on a slab that is bonded to a rigid base, or on a half-space; all presses are alike.

    radius_m : of the ball [m]; deepest_m : the greatest depth that is asked for [m]
    thickness_m : known, a range, or None for a half-space
    poisson, stiffening, sticking : known, or ranges, which make them ``parameters``
    folder : where the curves are kept, so that they are computed once; None keeps none
    workers : processes that compute them, None for one a core
    """

    def __init__(
        self,
        radius_m: float,
        deepest_m: float,
        law: str = "neo_hookean",
        thickness_m: Range | None = None,
        poisson: Range = (0.3, 0.49),
        stiffening: Range = 0.0,
        sticking: Range = 0.0,
        folder: Path | None = None,
        workers: int | None = None,
    ):
        raise NotImplementedError

    def forces(self, press: int, depth_m: np.ndarray, values: Mapping[str, float]) -> np.ndarray:
        """Return the forces (k,) [N] at ``depth_m`` (k,) [m] for young_pa = 1; see ``Forward``."""
        raise NotImplementedError

    def depths(self, press: int, force_n: np.ndarray, values: Mapping[str, float]) -> np.ndarray:
        """Return the depths (k,) [m] at which the forces are ``force_n`` (k,) [N] for young_pa = 1."""
        raise NotImplementedError
