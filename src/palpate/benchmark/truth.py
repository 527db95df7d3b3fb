"""Find the truth of presses: the limit of quadratic elements on ever finer levels of a body, with its own error.

Levels are extrapolated by the ratio of their changes (richardson.py). The lower that is, the larger is the limit's own
error; a sample whose own error or change between levels is too large judges no model. Models are evaluated against
the truth, and never see it.
"""

import warnings
from collections import Counter
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from palpate.benchmark.accuracy import OWN, Truth, TruthErrors, truth_errors, truth_levels
from palpate.benchmark.presses import Sample
from palpate.benchmark.richardson import RATIOS, limit_over, rejection
from palpate.bodies.body import Body
from palpate.bodies.refinement import quadratic_prolongation, with_midpoints
from palpate.bodies.surface_quadrature import enclosed_volume
from palpate.errors import NotConverged
from palpate.linalg.minimiser import Solution, minimise_by_newton
from palpate.solvers.equilibrium import FastEquilibrium
from palpate.solvers.stability import FIRM

MOST_OWN, MOST_CHANGE = 0.03, 0.03
"""Shares of the peak: outside of RATIOS, a sample whose own error, or whose change between the last two levels, is
larger (RMS over the surface) is rejected."""


FIRST = 1e-4
"""Tolerance of the level that starts from rest; its residual error is smaller than the change to the next level."""
MOST_ITERATIONS = 8
"""Newton iterations of a level that starts from the one before; 2 to 4 do where the levels converge, and where the body
snaps to another shape, 20 are too few."""

LBFGS_TOLERANCE = 0.1
"""L-BFGS goes on to this share of a tolerance: it stops where it is asked to, and Newton's last step far below."""


@dataclass(eq=False)
class Ascent:
    """Solutions for one sample on one level after another.

    levels : on which it is solved, coarse first
    surface : of each solved level the displacements (n_surface, 3) [m] of the body's fine surface
    least_det : the least determinant of the deformation gradient at any point of integration of any level
    volume_change : of the whole body, over its volume at rest, on the last solved level
    iterations, products : iterations of L-BFGS and Newton's method, and multigrid cycles, of all levels together
    clamped : whether a level that started from the one before still met an indefinite Hessian
    softest : softest value of the tangent over that at rest, on the last level where it was computed
    failure : why a level has no solution, or ""; finer ones are then not tried
    seconds : of all solutions [s]
    start : displacements (n, 3) [m] that the next level starts from
    """

    sample: Sample
    levels: range
    surface: list[np.ndarray] = field(default_factory=list)
    least_det: float = np.inf
    volume_change: float = np.nan
    iterations: int = 0
    products: int = 0
    clamped: bool = False
    softest: float = 0.0
    failure: str = ""
    seconds: float = 0.0
    start: np.ndarray | None = None


def ascend(
    body: Body, samples: Sequence[Sample], levels: Sequence[range], tolerance: float, progress: Callable = iter
) -> tuple[list[Ascent], Body]:
    """Solve for every sample on its ``levels``, each from the level before; return also the body with all these levels.

    tolerance : relative residual of the solutions that start from another level's
    progress : wraps the sequence of all solutions, as ``tqdm`` does
    One level is in memory at a time. A solution that fails is recorded as a ``failure`` and does not raise.
    """
    finest = max(levels_of[-1] for levels_of in levels)
    refined = with_midpoints(body, finest)
    ascents = [Ascent(sample, levels_of) for sample, levels_of in zip(samples, levels, strict=True)]
    todo = [(level, each) for level in range(finest + 1) for each in ascents if level in each.levels]
    problem: _Level | None = None
    for level, each in progress(todo):
        if problem is None or problem.level != level:
            problem = None  # before the next one is made, which is eight times as large
            problem = _Level(body, refined, level, level < finest)
        if not each.failure:
            problem.answer(each, tolerance)
    return ascents, refined


class _Level(FastEquilibrium):
    """The static problem of quadratic elements on one level, and the interpolation to the next if there is one."""

    clamped = False

    def __init__(self, body: Body, whole: Body, level: int, is_prolonged: bool):
        super().__init__(whole, level, order=2)
        self.level, self._body, self._whole = level, body, whole
        self._up = quadratic_prolongation(*whole.levels[level : level + 2]) if is_prolonged else None

    def linearise(self, x: np.ndarray, definite: bool = False) -> tuple:
        """Linearise as ``FastEquilibrium``, and record whether the Hessian had to be made ``definite``."""
        self.clamped |= definite
        return super().linearise(x, definite)

    def answer(self, ascent: Ascent, tolerance: float) -> None:
        """Solve for the sample of an ascent from its ``start``; add the solution, or the failure, to the ascent."""
        began, self.clamped, rest = perf_counter(), False, self.mesh.nodes
        start = None if ascent.start is None else rest + ascent.start
        try:
            forces = ascent.sample.nodal(self._body, self.level, 2, self._whole)
            solution = (
                self.settle(forces, LBFGS_TOLERANCE * FIRST)
                if start is None
                else self._follow(forces, tolerance, start)
            )
            if ascent.softest < FIRM:
                ascent.softest = self.check_stable(solution.x)
        except NotConverged as failure:
            ascent.failure, ascent.start = f"no answer on level {self.level}: {failure}", None
            return
        finally:
            ascent.seconds += perf_counter() - began
        ascent.clamped |= start is not None and self.clamped
        positions = solution.x
        ascent.iterations += solution.iterations
        ascent.products += solution.products
        ascent.least_det = min(ascent.least_det, self.least_det(positions))
        mesh = self._whole.levels[self.level]
        ascent.volume_change = enclosed_volume(mesh, positions) / enclosed_volume(mesh, rest) - 1.0
        fine_moved = moved = positions - rest
        ascent.start = None
        if self._up is not None:
            ascent.start = finer = self._up @ moved
            fine_moved = moved if len(moved) >= len(self._body.fine.nodes) else finer
        ascent.surface.append(fine_moved[self._body.fine.surface])

    def _follow(self, load: np.ndarray, tolerance: float, start: np.ndarray) -> Solution:
        """Find the equilibrium under ``load`` (n, 3) [N] near ``start`` (n, 3) [m], stable or not.

        NotConverged if there is none near, as the body buckles on one of the levels. A search for it in steps of the
        load from rest would take minutes, and the levels would have no limit.
        """

        def newton(begin: np.ndarray) -> Solution:
            return minimise_by_newton(self, begin, self._scale(load), tolerance, MOST_ITERATIONS)

        return self.settle(load, LBFGS_TOLERANCE * tolerance, start, newton)


NEXT = 1e-4
"""Tolerance of a solution that starts from the level before: with 1e-7 the limit is the same to 0.001 % of the peak."""
SQUEEZED = 0.5
"""Determinants of the deformation gradient below this are counted, and are no reason to reject: at the edge of an
anchor or a facet they fall with every halving, to 0.01 on the liver, whose ratios are 2.3 to 2.5 and limits agree to
0.2 %."""


def truth_of(
    body: Body, samples: Sequence[Sample], finest: Collection[int], progress: Callable = iter, tolerance: float = NEXT
) -> Truth:
    """Find the truth of presses; warns of those that are rejected.

    finest : the numbers of samples that are solved on the finest level; others are not where three levels remain
    progress, tolerance : as ``ascend`` takes them
    """
    levels = truth_levels(body)
    levels_of_sample = [levels if len(levels) < 4 or each.number in finest else levels[:-1] for each in samples]
    ascents, refined = ascend(body, samples, levels_of_sample, tolerance, progress)
    columns = columns_of([_row(body, each, len(levels)) for each in ascents])
    consequence = "they are left out."
    if columns["rejected"].all():
        consequence = (
            "models are judged by their distance from the finest elements, which may be far from the truth; lay the "
            "body on a bed, hold more of it, press less, or refine it."
        )
    warn_of_rejected(body.name, "presses", columns["rejected"], consequence)
    finest_level = max(each.levels[-1] for each in ascents)
    return Truth(
        **columns,
        radius_m=samples[0].radius_m,
        level=finest_level,
        elements=len(refined.levels[finest_level].tetrahedra),
        nodes=len(refined.levels[finest_level + 1].nodes),
    )


class _Pressed(NamedTuple):
    displacement: np.ndarray


def _row(body: Body, ascent: Ascent, count: int) -> dict[str, Any]:
    """Return one sample's values of the fields of ``Truth``; of ``count`` levels those without an answer are NaN."""
    surface = np.full((count, len(body.fine.surface), 3), np.nan)
    surface[: len(ascent.surface)] = ascent.surface if ascent.surface else np.nan
    patch = ascent.sample.pressed(body)

    def errors(answer: _Pressed, truth: _Pressed) -> TruthErrors:
        return truth_errors(answer.displacement, truth.displacement, patch)

    row = {name: getattr(ascent, name) for name in ("least_det", "volume_change", "iterations", "products", "seconds")}
    row |= {"sample": ascent.sample.number, "levels": surface}
    if ascent.failure:
        row |= {"displacement": np.full(surface.shape[1:], np.nan), "ratio": np.nan, "own": [np.nan] * len(OWN)}
        return row | {"rejected": f"{NO_ANSWER} ({ascent.failure})"}
    limit = limit_over({(level,): _Pressed(moved) for level, moved in enumerate(ascent.surface)}, (0,), (None,))
    rate, own_error = limit.ratios[0].displacement, TruthErrors(*limit.own(errors)[0])
    change = truth_errors(ascent.surface[-2], ascent.surface[-1], patch).rmse_of_peak
    row |= {"displacement": limit.answer.displacement, "ratio": rate, "own": own_error}
    return row | {"rejected": objection(rate, own_error.rmse_of_peak, change, ascent.least_det, ascent.clamped)}


def columns_of(rows: Sequence[dict[str, Any]]) -> dict[str, np.ndarray]:
    """Return the columns (k, ...) of k rows by name; text, such as why a truth is rejected, as objects."""
    columns = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    return {name: each.astype(object) if each.dtype.kind == "U" else each for name, each in columns.items()}


NO_ANSWER, INVERTED, CLAMPED = "no answer on a level", "an element is inverted", "the Hessian had to be clamped"
APART = "the levels are too far apart"
"""Reasons to reject a sample; numbers follow in brackets."""


def objection(rate: float, own: float, change: float, least_det: float, clamped: bool) -> str:
    """Return why the limit of levels is not believed, or "".

    rate : ratio of the last two changes; own, change : own error and last change, limited by MOST_OWN and MOST_CHANGE
    least_det, clamped : as of ``Ascent``
    """
    close = RATIOS[0] <= rate <= RATIOS[1] or (own <= MOST_OWN and change <= MOST_CHANGE)
    return rejection(
        (close, f"{APART} (ratio {rate:.3g}, last change {change:.1%}, own error {own:.1%} of the peak)"),
        (least_det > 0.0, f"{INVERTED} (det F {least_det:.3g})"),
        (not clamped, CLAMPED),
    )


def over(function: Callable[[np.ndarray], Any], values: np.ndarray) -> float:
    """Apply ``function``, such as the mean, to the finite ones of ``values``; NaN if there are none."""
    values = values[np.isfinite(values)]
    return float(function(values)) if len(values) else np.nan


def reasons(rejected: np.ndarray) -> dict[str, int]:
    """Count the first reason of each of ``rejected`` (k,), by which samples have no truth; the most frequent first."""
    first = [str(why).partition(" (")[0].partition(";")[0] for why in rejected if why]
    return dict(Counter(first).most_common())


def warn_of_rejected(place: str, questions: str, rejected: np.ndarray, then: str) -> None:
    """Warn of ``questions`` of a body that have no truth; rejected : (k,) why, or ""; then : what follows from that."""
    if counts := reasons(rejected):
        why = "; ".join(f"{count} times {reason}" for reason, count in counts.items())
        lost = f"{sum(counts.values())} of {len(rejected)} {questions}"
        warnings.warn(f"bodies.{place}: {lost} have no truth that is believed ({why}); {then}", stacklevel=3)
