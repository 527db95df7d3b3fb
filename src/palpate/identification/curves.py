"""Force over depth of a ball on a bonded slab, for ranges of its parameters: computed once, kept, and interpolated."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np


@dataclass(frozen=True)
class Ranges:
    """What a family of curves is for; a range whose ends are equal is a value, and adds no dimension.

    deepest : depth over the ball's radius; poisson, stiffening : least and greatest
    thinness : radius over thickness, 0 for a half-space; sticking : 0 slips, 1 sticks
    """

    deepest: float
    poisson: tuple[float, float]
    thinness: tuple[float, float] = (0.0, 0.0)
    stiffening: tuple[float, float] = (0.0, 0.0)
    sticking: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, eq=False)
class CurveFamily:
    """Curves of one law; error : greatest relative error of force by interpolation, as measured between its nodes."""

    law: str
    ranges: Ranges
    error: float

    def forces(
        self, depth: np.ndarray, poisson: float, thinness: float = 0.0, stiffening: float = 0.0, sticking: float = 0.0
    ) -> np.ndarray:
        """Return forces (k,) over E a² at depths (k,) over the radius a; 0 for depths below 0."""
        raise NotImplementedError

    def depths(
        self, force: np.ndarray, poisson: float, thinness: float = 0.0, stiffening: float = 0.0, sticking: float = 0.0
    ) -> np.ndarray:
        """Return the depths (k,) over the radius at which ``forces`` are ``force`` (k,)."""
        raise NotImplementedError


def family_of(law: str, ranges: Ranges, folder: Path | None = None, workers: int | None = None) -> CurveFamily:
    """Return the curves of ``law`` for ``ranges``: read from ``folder`` where they are there, or computed and kept."""
    raise NotImplementedError
