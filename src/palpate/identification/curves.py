"""Force over depth of a ball on a bonded slab, for ranges of its parameters: computed once, stored, and interpolated.

The logarithm of the force over Hertz's is smooth in the root of depth and in the parameters. It is interpolated by
polynomials on a sparse grid of Clenshaw and Curtis's points (Smolyak 1963; Barthelmann, Novak, Ritter 2000), which
gets finer until curves at places between are met.
"""

import hashlib
import inspect
import json
import os
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from itertools import product
from pathlib import Path

import numpy as np
from numpy.polynomial import chebyshev
from threadpoolctl import threadpool_limits

from palpate.bodies.material import EXPONENTIAL, exponential
from palpate.effects import law as effects_law
from palpate.errors import InputError, NotConverged
from palpate.identification import axisymmetric_elements, axisymmetric_indentation, slab_section
from palpate.identification.axisymmetric_indentation import BallOnSlab, hertz
from palpate.identification.progress import UNFOLLOWED, Progress
from palpate.stores import store, stored

ALONG = 12
"""Coefficients of a curve along the root of depth."""
GRIDS = ((2, 2), (2, 3), (2, 4), (2, 6), (3, 4))
"""Grids, from coarse to fine: greatest level of a dimension, and of their sum; (2, 6) is full in three dimensions."""
MOST_CURVES = 130
"""Points above which a grid is not tried: thin slabs of steep laws need all of the 125 of (2, 6)."""
MOST_STICKING = 30
"""The same of what sticking changes."""
MOST_ERROR = 3e-3
"""Relative error of force by interpolation at which the grid is fine enough."""
CHECKS, SEED = 4, 34
"""Curves at random places between that the error is measured at."""
THINNEST = 5.0
"""Radius of the ball over the thickness of a slab, above which forces are not known."""
BEYOND = 0.52
"""Curves change most near ν = 0.5; they are interpolated in the logarithm of this less ν."""
STEEP = 8.0
"""Stiffenings are interpolated in the logarithm of 1 plus their share of this: between 3 and 10, three points have an
error of 1.4 to 3 % where with 1 they have 8 % (0.44 radii into a slab of 1.7, up to 20)."""


@dataclass(frozen=True)
class Ranges:
    """Ranges, least and greatest, of the parameters that a family of curves is interpolated over.

    A range whose ends are equal is a known value, and adds no dimension. InputError for a range of impossible values.

    deepest : largest depth over the ball's radius; poisson : ν; stiffening : of the exponential law
    thinness : the ball's radius over the slab's thickness, 0 for a half-space
    sticking : 0 slips, 1 sticks; between, forces are interpolated
    """

    deepest: float
    poisson: tuple[float, float]
    thinness: tuple[float, float] = (0.0, 0.0)
    stiffening: tuple[float, float] = (0.0, 0.0)
    sticking: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        limits = {"poisson": 0.499, "thinness": THINNEST, "stiffening": 100.0, "sticking": 1.0}
        for name, most in limits.items():
            low, high = getattr(self, name)
            if not 0.0 <= low <= high <= most:
                raise InputError(f"{name} is {low:g} to {high:g}; give a range within 0 to {most:g}.")
        if not 0.0 < self.deepest < np.inf:
            raise InputError(f"the depth is {self.deepest:g} radii; give a positive number.")
        if self.deepest * self.thinness[1] >= 1.0:
            raise InputError(
                f"the ball is pushed {self.deepest:.3g} radii deep through a slab of {1.0 / self.thinness[1]:.3g}; "
                "give a greater least thickness_m, or leave out the deepest points."
            )


STIFFENING = "stiffening"
FREE = ("poisson", "thinness", STIFFENING)
"""What the sparse grid is over, in this order, where it is free."""


AXES: Mapping[str, tuple[Callable, Callable]] = {
    "poisson": (lambda value: -np.log(BEYOND - value), lambda axis: BEYOND - np.exp(-axis)),
    "thinness": (float, float),
    STIFFENING: (lambda value: np.log1p(value / STEEP), lambda axis: STEEP * np.expm1(axis)),
}
"""What a parameter is interpolated in, and the inverse."""


@dataclass(frozen=True, eq=False)
class Curves:
    """Stored interpolation of one law's curves, by Chebyshev polynomials in the parameters and the root of depth.

    error : greatest relative error of force, measured at places between those of the grid
    least_error : the same with the least stiffening, where curves are less steep
    degrees : (n, free) of the n polynomials in the free parameters
    coefficients : (1 or 2, n, ALONG), of a ball that slips, that sticks, or both
    """

    error: float
    least_error: float
    degrees: np.ndarray
    coefficients: np.ndarray


@dataclass(frozen=True, eq=False)
class CurveFamily(Curves):
    """Curves for ``ranges``."""

    ranges: Ranges

    def forces(
        self, depth: np.ndarray, poisson: float, thinness: float = 0.0, stiffening: float = 0.0, sticking: float = 0.0
    ) -> np.ndarray:
        """Interpolate forces (k,) over E a² at ``depth`` (k,) over the ball's radius a; 0 for depths below 0.

        InputError for a depth or a parameter outside of the ranges.
        """
        depth = np.asarray(depth, dtype=float)
        if depth.size and not depth.max() <= self.ranges.deepest * (1.0 + 1e-9):
            raise InputError(
                f"a depth is {depth.max():.3g} radii of the ball, and the curves end at {self.ranges.deepest:.3g}; "
                "make them for the deepest press."
            )
        values = {"poisson": poisson, "thinness": thinness, "stiffening": stiffening, "sticking": sticking}
        for name, value in values.items():
            low, high = getattr(self.ranges, name)
            slack = 1e-9 * max(1.0, abs(high))
            if not low - slack <= value <= high + slack:
                raise InputError(f"{name} is {value:.4g}, and the curves are for {low:.4g} to {high:.4g}.")
        place = np.array([[_place(self.ranges, name, values[name]) for name in _free(self.ranges)]])
        curves = (_basis(place, self.degrees) @ self.coefficients)[:, 0]
        curve = curves[0] if len(curves) == 1 else (1.0 - sticking) * curves[0] + sticking * curves[1]
        root = np.sqrt(np.maximum(depth, 0.0))
        over_hertz = np.exp(chebyshev.chebval(2.0 * root / np.sqrt(self.ranges.deepest) - 1.0, curve))
        return over_hertz * hertz(poisson) * root**3


def _free(ranges: Ranges) -> list[str]:
    return [name for name in FREE if getattr(ranges, name)[0] < getattr(ranges, name)[1]]


def _values(ranges: Ranges, place: tuple[float, ...]) -> tuple[float, ...]:
    """Return ν, thinness and stiffening at a ``place`` of the grid, whose coordinates of free ones are in −1 … 1."""
    values = {name: getattr(ranges, name)[0] for name in FREE}
    for name, coordinate in zip(_free(ranges), place, strict=True):
        low, high = map(AXES[name][0], getattr(ranges, name))
        values[name] = float(AXES[name][1](low + 0.5 * (coordinate + 1.0) * (high - low)))
    return tuple(values.values())


def _place(ranges: Ranges, name: str, value: float) -> float:
    """Return the coordinate in −1 … 1 of a parameter's value in its range, along the axis that AXES has for it."""
    low, high, at = map(AXES[name][0], (*getattr(ranges, name), value))
    return float(np.clip(2.0 * (at - low) / (high - low) - 1.0, -1.0, 1.0))


def _basis(places: np.ndarray, degrees: np.ndarray) -> np.ndarray:
    """Evaluate n products of Chebyshev polynomials of ``degrees`` (n, d) at ``places`` (m, d), as (m, n)."""
    return np.cos(np.arccos(np.clip(places, -1.0, 1.0))[:, None] * degrees[None]).prod(axis=2)


def _sparse_grid(dimensions: int, most: int, most_of_sum: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the places (n, d) of Smolyak's sparse grid and the degrees (n, d) of the polynomials that they determine.

    most, most_of_sum : greatest level of a dimension, and greatest sum of the levels of all
    """
    # each level of a dimension adds points of Clenshaw and Curtis's rule, and as many degrees
    added: list[tuple[list[float], list[int]]] = [([0.0], [0]), ([-1.0, 1.0], [1, 2])]
    for level in range(2, most + 1):
        count = 2**level
        points = np.cos(np.pi * np.arange(1, count, 2) / count)
        added.append((points.tolist(), list(range(count // 2 + 1, count + 1))))
    places: list[tuple[float, ...]] = []
    degrees: list[tuple[int, ...]] = []
    for levels in product(range(most + 1), repeat=dimensions):
        if sum(levels) <= most_of_sum:
            places += product(*(added[level][0] for level in levels))
            degrees += product(*(added[level][1] for level in levels))
    shape = (len(places), dimensions)
    return np.array(places).reshape(shape), np.array(degrees, dtype=int).reshape(shape)


def _simulated(job: tuple[str, float, float, float, float, bool]) -> np.ndarray | str:
    """Simulate the press of a ball; return the log of its force over Hertz's (ALONG,), or a sentence why there is none.

    job : law, largest depth, ν, thinness, stiffening, and whether the ball sticks
    The forces are at Chebyshev points of the root of depth.
    """
    law, deepest, poisson, thinness, stiffening, sticks = job
    thickness = 1.0 / thinness if thinness else np.inf
    where = f"ν {poisson:.3g}, thickness {thickness:.3g} radii, stiffening {stiffening:.3g}"
    try:
        with threadpool_limits(1):
            name = exponential(stiffening) if law == EXPONENTIAL else law
            ball = BallOnSlab(name, poisson, thickness, sticks)
            curve = ball.curve(deepest)
    except NotConverged as failure:
        return f"{law} ({where}): {failure}"
    depth = np.sqrt(deepest) * np.linspace(0.0, 1.0, 200)[1:]
    if (np.diff(curve.at(depth**2)) <= 0.0).any():
        return f"{law} ({where}): the force falls as the ball goes deeper"
    roots = 0.5 * np.sqrt(deepest) * (chebyshev.chebpts1(ALONG) + 1.0)
    return np.log(curve.at(roots**2) / (hertz(poisson) * roots**3))


def family_of(law: str, ranges: Ranges, folder: Path | None = None, progress: Progress = UNFOLLOWED) -> CurveFamily:
    """Return the curves of ``law`` for ``ranges``: read from ``folder``, or computed and stored there.

    law : ``exponential`` alone has a stiffening; folder : None stores nothing
    Raises InputError for the stiffening of another law, NotConverged for one without equilibrium at the largest depth.
    """
    if law != EXPONENTIAL and ranges.stiffening != (0.0, 0.0):
        raise InputError(f"law {law} has no stiffening; give 0, or take the law {EXPONENTIAL}.")
    path = Path(folder) / f"curves-{_digest(law, ranges)}.h5" if folder is not None else None
    if path is not None and path.is_file():
        return CurveFamily(**vars(stored(Curves, path)), ranges=ranges)
    curves = _computed(law, ranges, progress)
    if path is not None:
        store(curves, path, compressed=True)
    return CurveFamily(**vars(curves), ranges=ranges)


def _computed(law: str, ranges: Ranges, progress: Progress) -> Curves:
    """Compute curves on ever finer grids until those at places between are interpolated well, or no grid is left.

    What sticking changes is a few per cent, except far into soft slabs, and is interpolated on a coarser grid.
    Raises NotConverged where a curve has no equilibrium.
    """
    free = _free(ranges)
    flags = [False] * (ranges.sticking[0] < 1.0) + [True] * (ranges.sticking[1] > 0.0)  # whether it sticks
    curves: dict[tuple[tuple[float, ...], bool], np.ndarray] = {}

    with ProcessPoolExecutor(os.cpu_count()) as pool:  # which starts a process as it is needed

        def compute(places: np.ndarray, sticks: bool) -> np.ndarray:
            """Return curves (m, ALONG) at ``places`` (m, d) of the grid, of which each is simulated once."""
            new = [place for place in map(tuple, places) if (place, sticks) not in curves]
            jobs: list = [(law, ranges.deepest, *_values(ranges, place), sticks) for place in new]
            answers = map(_simulated, jobs) if len(jobs) < 3 else pool.map(_simulated, jobs)
            for place, answer in zip(progress.follow(f"{law}: curves", new), answers, strict=True):
                if isinstance(answer, str):
                    raise NotConverged(f"{answer}; leave out the deepest points, or narrow the ranges", [float("nan")])
                curves[place, sticks] = answer
            return np.array([curves[place, sticks] for place in map(tuple, places)])

        def change_by_sticking(places: np.ndarray) -> np.ndarray:
            return compute(places, True) - compute(places, False)

        # first the steepest law on the thinnest slab, which fails before all others
        compute(np.ones((1, len(free))), flags[-1])
        between = np.random.default_rng(SEED).uniform(-1.0, 1.0, (CHECKS, len(free)))
        degrees, values, error = _interpolated(lambda places: compute(places, flags[0]), between, MOST_CURVES)
        coefficients = {tuple(map(int, each)): [row] for each, row in zip(degrees, values, strict=True)}
        if len(flags) == 2:
            zeros = np.zeros(ALONG)
            degrees, values, error_of_change = _interpolated(change_by_sticking, between, MOST_STICKING)
            changes = {tuple(map(int, each)): row for each, row in zip(degrees, values, strict=True)}
            for each in coefficients | changes:
                of_both = coefficients.setdefault(each, [zeros])
                of_both.append(of_both[0] + changes.get(each, zeros))
            error = float(np.hypot(error, error_of_change))
        by_end = np.array(list(coefficients.values())).transpose(1, 0, 2)
        degrees = np.array(list(coefficients), dtype=int).reshape(len(coefficients), len(free))
        least_error = error
        if STIFFENING in free:
            between[:, free.index(STIFFENING)] = -1.0
            errors = [_basis(between, degrees) @ by_end[k] - compute(between, flag) for k, flag in enumerate(flags)]
            least_error = float(np.abs(np.expm1(errors)).max())
    # matrix from values at Chebyshev points of the root of depth to coefficients
    to_curve = np.linalg.inv(chebyshev.chebvander(chebyshev.chebpts1(ALONG), ALONG - 1)).T
    return Curves(error, least_error, degrees, by_end @ to_curve)


def _interpolated(
    curves: Callable[[np.ndarray], np.ndarray], between: np.ndarray, most: int
) -> tuple[np.ndarray, np.ndarray, float]:
    """Interpolate ``curves`` on ever finer grids of at most ``most`` places, until the error is at most MOST_ERROR.

    curves : returns those (m, ALONG) at places (m, d); between : (k, d) places where the error is measured
    Returns the best grid's degrees (n, d) of polynomials, coefficients (n, ALONG), and largest relative error of force.
    """
    free = between.shape[1]
    simulated, error, least_error = curves(between) if free else None, 0.0, np.inf
    for places, degrees in (grid for grid in (_sparse_grid(free, *each) for each in GRIDS) if len(grid[0]) <= most):
        coefficients = np.linalg.solve(_basis(places, degrees), curves(places))
        if simulated is not None:
            error = float(np.abs(np.expm1(_basis(between, degrees) @ coefficients - simulated)).max())
        if error < least_error:
            least_error, best = error, (degrees, coefficients, error)
        if error <= MOST_ERROR:
            break
    return best


def _digest(law: str, ranges: Ranges) -> str:
    """Return a hash of what is asked for and of the code that computes it, by which stored curves are named."""
    said = json.dumps([law, asdict(ranges), ALONG, GRIDS, MOST_CURVES, MOST_STICKING, MOST_ERROR, CHECKS, SEED, STEEP])
    modules = (axisymmetric_indentation, axisymmetric_elements, slab_section, effects_law)
    files = [Path(law)] if Path(law).suffix == ".py" and Path(law).is_file() else []
    files += [Path(inspect.getfile(module)) for module in modules]
    files += sorted((Path(inspect.getfile(effects_law)).parent / "laws").glob("*.py"))
    sources = "".join(path.read_text(encoding="utf-8") for path in files)
    return hashlib.sha256((said + sources).encode()).hexdigest()[:16]
