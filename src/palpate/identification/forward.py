"""Forward models of pressed tissue, from parameters to forces: their interface, and a ball on a slab or a half-space.

Forces are those of a tissue with Young's modulus 1 Pa: all laws are proportional to it, so that a fit multiplies them.
"""

from collections.abc import Mapping
from copy import copy
from pathlib import Path
from typing import NamedTuple, Protocol

import numpy as np

from palpate.errors import InputError
from palpate.identification.curves import THINNEST, CurveFamily, Ranges, family_of
from palpate.identification.progress import UNFOLLOWED, Progress

MEASURED_ERROR = 0.003
"""Of the force off quadratic elements in three dimensions: 0.3, 0 and 0 % at depths of 0.25, 0.5 and 0.75 radii with
elements of 0.18 radii, 0.1 to 0.2 % off their limit, measured on one slab."""
Range = tuple[float, float]
"""The least and the greatest that a value may have, which are the same where it is known."""


class Parameter(NamedTuple):
    """A parameter of a forward model that presses are to determine: its name, which ends in a unit, and its range."""

    name: str
    low: float
    high: float


class Forward(Protocol):
    """A forward model: it returns the forces of presses for given parameters.

    parameters : any of poisson, stiffening, thickness_m, sticking (0 slips to 1 sticks)
    relative_error : standard deviation of the relative error of force, as measured against the truth of touches
    common_error : the part of it that all presses have in common; the rest averages out over places
    deepest_m : largest depth [m]
    """

    deepest_m: float

    @property
    def relative_error(self) -> float: ...

    @property
    def common_error(self) -> float: ...

    @property
    def parameters(self) -> tuple[Parameter, ...]: ...

    def forces(self, press: int, depth_m: np.ndarray, values: Mapping[str, float]) -> np.ndarray:
        """Return the forces (k,) [N] of press number ``press`` at ``depth_m`` (k,) [m] for young_pa = 1.

        values : of each of ``parameters``
        Forces are smooth in depth and values, increase with depth, and are 0 for depths below 0. InputError for a
        depth above ``deepest_m`` or a value outside its range, KeyError for a missing one.
        """
        ...


class SlabForward:
    """Forward model of a ball on a slab that is bonded to a rigid base, or on a half-space.

    radius_m : of the ball [m]; deepest_m : the greatest depth of the presses [m]
    thickness_m : of the slab [m], or None for a half-space
    each_m : (presses,) thickness at each press [m], within that range; or None, where it is a parameter
    poisson, stiffening, sticking : ``parameters`` unless their ends are the same; ``exponential`` has a stiffening
    folder : where computed curves are stored for the next time, or None
    InputError for impossible lengths and ranges, NotConverged where the law has no equilibrium at ``deepest_m``.
    """

    def __init__(
        self,
        radius_m: float,
        deepest_m: float,
        law: str = "neo_hookean",
        thickness_m: Range | None = None,
        poisson: Range = (0.3, 0.49),
        stiffening: Range = (0.0, 0.0),
        sticking: Range = (0.0, 0.0),
        folder: Path | None = None,
        progress: Progress = UNFOLLOWED,
        each_m: np.ndarray | None = None,
    ):
        self._radius, self._each = radius_m, each_m
        self._thickness = thickness_m
        if thickness_m is not None and not 0.0 < thickness_m[0] <= thickness_m[1] < np.inf:
            raise InputError(f"thickness_m is {thickness_m}; give a range of positive lengths [m], or none.")
        low, high = thickness_m or (np.inf, np.inf)
        thinness = (radius_m / high, radius_m / low)
        if thinness[1] > THINNEST:
            raise InputError(
                f"the ball's radius of {radius_m:g} m is {thinness[1]:.3g} times the slab's thickness of {low:g} m; "
                f"forces are known up to {THINNEST:g} times: give a smaller ball or a greater least thickness."
            )
        self._ranges = {"poisson": poisson, "stiffening": stiffening, "sticking": sticking}
        ranges = Ranges(deepest_m / radius_m, thinness=thinness, **self._ranges)
        self._family: CurveFamily = family_of(law, ranges, folder, progress)
        self.deepest_m, self.relative_error = deepest_m, float(np.hypot(MEASURED_ERROR, self._family.error))

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        lengths = {} if self._thickness is None or self._each is not None else {"thickness_m": self._thickness}
        free = {name: ends for name, ends in (self._ranges | lengths).items() if ends[0] < ends[1]}
        return tuple(Parameter(name, *ends) for name, ends in free.items())

    @property
    def known(self) -> dict[str, float]:
        """Poisson's ratio, stiffening and sticking where they have no range."""
        return {name: low for name, (low, high) in self._ranges.items() if low == high}

    @property
    def common_error(self) -> float:
        """The whole error: all presses are alike."""
        return self.relative_error

    def without_stiffening(self) -> "SlabForward":
        """Return the model with a stiffening of 0, which is neo-Hookean; its range of stiffening has to begin there."""
        other = copy(self)
        other._ranges = self._ranges | {"stiffening": (0.0, 0.0)}
        other.relative_error = float(np.hypot(MEASURED_ERROR, self._family.least_error))
        return other

    def forces(self, press: int, depth_m: np.ndarray, values: Mapping[str, float]) -> np.ndarray:
        """Return the forces (k,) [N] at ``depth_m`` (k,) [m] for young_pa = 1; see ``Forward``."""
        given = {name: values[name] if low < high else low for name, (low, high) in self._ranges.items()}
        if self._thickness is not None:
            low, _ = self._thickness
            thickness = float(self._each[press]) if self._each is not None else values.get("thickness_m", low)
            given["thinness"] = self._radius / thickness
        return self._family.forces(np.asarray(depth_m) / self._radius, **given) * self._radius**2
