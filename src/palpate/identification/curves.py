"""Force over depth of a ball on a bonded slab, for ranges of its parameters: computed once, kept, and interpolated.

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
from palpate.identification.progress import Follow, unfollowed
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
    """What a family of curves is for; a range whose ends are equal is a value, and adds no dimension.

    deepest : depth over the ball's radius; poisson, stiffening : least and greatest
    thinness : radius over thickness, 0 for a half-space; sticking : 0 slips, 1 sticks, and interpolated between
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
    """Curves of one law, as they are kept.

    error : greatest relative error of force by interpolation at places between, measured
    least_error : the same with the least stiffening, where curves are less steep
    degrees : (n, free) of the basis; coefficients : (slips, sticks or both, n, ALONG)
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
        """Return forces (k,) over E a² at depths (k,) over the radius a; 0 for depths below 0.

        InputError for a depth or a parameter outside of the ranges.
        """
        depth = np.asarray(depth, dtype=float)
        if depth.size and not depth.max() <= self.ranges.deepest * (1.0 + 1e-9):
            raise InputError(
                f"a depth is {depth.max():.3g} radii of the ball, and the curves end at {self.ranges.deepest:.3g}; "
                "make them for the deepest press."
            )
        given = {"poisson": poisson, "thinness": thinness, "stiffening": stiffening, "sticking": sticking}
        for name, value in given.items():
            low, high = getattr(self.ranges, name)
            near = 1e-9 * max(1.0, abs(high))
            if not low - near <= value <= high + near:
                raise InputError(f"{name} is {value:.4g}, and the curves are for {low:.4g} to {high:.4g}.")
        place = np.array([[_place(self.ranges, name, given[name]) for name in _free(self.ranges)]])
        curves = (_basis(place, self.degrees) @ self.coefficients)[:, 0]
        curve = curves[0] if len(curves) == 1 else (1.0 - sticking) * curves[0] + sticking * curves[1]
        root = np.sqrt(np.maximum(depth, 0.0))
        share = np.exp(chebyshev.chebval(2.0 * root / np.sqrt(self.ranges.deepest) - 1.0, curve))
        return share * hertz(poisson) * root**3


def _free(ranges: Ranges) -> list[str]:
    return [name for name in FREE if getattr(ranges, name)[0] < getattr(ranges, name)[1]]


def _values(ranges: Ranges, place: tuple[float, ...]) -> tuple[float, ...]:
    """Return ν, thinness and stiffening at a ``place`` of the grid, from −1 to 1 along what is free."""
    found = {name: getattr(ranges, name)[0] for name in FREE}
    for name, at in zip(_free(ranges), place, strict=True):
        low, high = map(AXES[name][0], getattr(ranges, name))
        found[name] = float(AXES[name][1](low + 0.5 * (at + 1.0) * (high - low)))
    return tuple(found.values())


def _place(ranges: Ranges, name: str, value: float) -> float:
    """Return where a value is in its range, from −1 to 1."""
    low, high, at = map(AXES[name][0], (*getattr(ranges, name), value))
    return float(np.clip(2.0 * (at - low) / (high - low) - 1.0, -1.0, 1.0))


def _basis(places: np.ndarray, degrees: np.ndarray) -> np.ndarray:
    """Return products of Chebyshev's polynomials of ``degrees`` (n, d) at ``places`` (m, d), as (m, n)."""
    return np.cos(np.arccos(np.clip(places, -1.0, 1.0))[:, None] * degrees[None]).prod(axis=2)


def _sparse(dimensions: int, level: int, whole: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the places (n, d) of a sparse grid and the degrees (n, d) of the polynomials that it determines.

    level : the greatest of a dimension; whole : that of their sum
    """
    lines: list[tuple[list[float], list[int]]] = [([0.0], [0]), ([-1.0, 1.0], [1, 2])]
    for each in range(2, level + 1):
        count = 2**each
        new = np.cos(np.pi * np.arange(1, count, 2) / count)
        lines.append((new.tolist(), list(range(count // 2 + 1, count + 1))))
    places: list[tuple[float, ...]] = []
    degrees: list[tuple[int, ...]] = []
    for levels in product(range(level + 1), repeat=dimensions):
        if sum(levels) <= whole:
            places += product(*(lines[each][0] for each in levels))
            degrees += product(*(lines[each][1] for each in levels))
    shape = (len(places), dimensions)
    return np.array(places).reshape(shape), np.array(degrees, dtype=int).reshape(shape)


def _sampled(asked: tuple[str, float, float, float, float, bool]) -> np.ndarray | str:
    """Return log force over Hertz's at Chebyshev's points of the root of depth (ALONG,), or why there is none."""
    law, deepest, poisson, thinness, stiffening, sticks = asked
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


def family_of(law: str, ranges: Ranges, folder: Path | None = None, follow: Follow = unfollowed) -> CurveFamily:
    """Return the curves of ``law`` for ``ranges``: read from ``folder`` where they are there, or computed and kept.

    law : ``exponential`` has a stiffening
    Raises NotConverged where the law has no equilibrium to the depth that is asked for.
    """
    if law != EXPONENTIAL and ranges.stiffening != (0.0, 0.0):
        raise InputError(f"law {law} has no stiffening; give 0, or take the law {EXPONENTIAL}.")
    path = Path(folder) / f"curves-{_digest(law, ranges)}.h5" if folder is not None else None
    if path is not None and path.is_file():
        return CurveFamily(**vars(stored(Curves, path)), ranges=ranges)
    found = _computed(law, ranges, follow)
    if path is not None:
        store(found, path, compressed=True)
    return CurveFamily(**vars(found), ranges=ranges)


def _computed(law: str, ranges: Ranges, follow: Follow) -> Curves:
    """Compute curves on finer grids until those between are met, or the last grid is reached.

    What sticking changes is a few per cent, except far into soft slabs, and is interpolated on a coarser grid.
    """
    free = _free(ranges)
    ends = [False] * (ranges.sticking[0] < 1.0) + [True] * (ranges.sticking[1] > 0.0)  # which of them stick
    curves: dict[tuple[tuple[float, ...], bool], np.ndarray] = {}

    with ProcessPoolExecutor(os.cpu_count()) as pool:  # which starts a process as it is needed

        def compute(places: np.ndarray, sticks: bool) -> np.ndarray:
            """Return curves (m, ALONG) at ``places`` (m, d) of the grid."""
            new = [place for place in map(tuple, places) if (place, sticks) not in curves]
            asked: list = [(law, ranges.deepest, *_values(ranges, place), sticks) for place in new]
            answers = map(_sampled, asked) if len(asked) < 3 else pool.map(_sampled, asked)
            for place, answer in zip(follow(f"{law}: curves", new), answers, strict=True):
                if isinstance(answer, str):
                    raise NotConverged(f"{answer}; leave out the deepest points, or narrow the ranges", [float("nan")])
                curves[place, sticks] = answer
            return np.array([curves[place, sticks] for place in map(tuple, places)])

        def more(places: np.ndarray) -> np.ndarray:
            return compute(places, True) - compute(places, False)

        # the steepest law on the thinnest slab bears least
        compute(np.ones((1, len(free))), ends[-1])
        between = np.random.default_rng(SEED).uniform(-1.0, 1.0, (CHECKS, len(free)))
        degrees, first, error = _interpolated(lambda places: compute(places, ends[0]), between, MOST_CURVES)
        coefficients = {tuple(map(int, each)): [row] for each, row in zip(degrees, first, strict=True)}
        if len(ends) == 2:
            nothing = np.zeros(ALONG)
            finer, added, off = _interpolated(more, between, MOST_STICKING)
            steps = {tuple(map(int, each)): row for each, row in zip(finer, added, strict=True)}
            for each in coefficients | steps:
                slips = coefficients.setdefault(each, [nothing])
                slips.append(slips[0] + steps.get(each, nothing))
            error = float(np.hypot(error, off))
        by_end = np.array(list(coefficients.values())).transpose(1, 0, 2)
        found = np.array(list(coefficients), dtype=int).reshape(len(coefficients), len(free))
        least = error
        if STIFFENING in free:
            between[:, free.index(STIFFENING)] = -1.0
            beside = [_basis(between, found) @ by_end[k] - compute(between, end) for k, end in enumerate(ends)]
            least = float(np.abs(np.expm1(beside)).max())
    to_curve = np.linalg.inv(chebyshev.chebvander(chebyshev.chebpts1(ALONG), ALONG - 1)).T
    return Curves(error, least, found, by_end @ to_curve)


def _interpolated(
    curves: Callable[[np.ndarray], np.ndarray], between: np.ndarray, most: int
) -> tuple[np.ndarray, np.ndarray, float]:
    """Interpolate ``curves`` of places (m, d) on grids of at most ``most`` places, until one is fine enough.

    Returns of the best the degrees (n, d) of the basis, coefficients (n, ALONG), and the greatest relative error of
    force at the places ``between`` (k, d).
    """
    free = between.shape[1]
    wanted, error, least = curves(between) if free else None, 0.0, np.inf
    for places, degrees in (grid for grid in (_sparse(free, *each) for each in GRIDS) if len(grid[0]) <= most):
        found = np.linalg.solve(_basis(places, degrees), curves(places))
        if wanted is not None:
            error = float(np.abs(np.expm1(_basis(between, degrees) @ found - wanted)).max())
        if error < least:
            least, reached = error, (degrees, found, error)
        if error <= MOST_ERROR:
            break
    return reached


def _digest(law: str, ranges: Ranges) -> str:
    """Return a name of what is asked for and of the code that answers it."""
    said = json.dumps([law, asdict(ranges), ALONG, GRIDS, MOST_CURVES, MOST_STICKING, MOST_ERROR, CHECKS, SEED, STEEP])
    modules = (axisymmetric_indentation, axisymmetric_elements, slab_section, effects_law)
    files = [Path(law)] if Path(law).suffix == ".py" and Path(law).is_file() else []
    files += [Path(inspect.getfile(module)) for module in modules]
    files += sorted((Path(inspect.getfile(effects_law)).parent / "laws").glob("*.py"))
    sources = "".join(path.read_text(encoding="utf-8") for path in files)
    return hashlib.sha256((said + sources).encode()).hexdigest()[:16]
