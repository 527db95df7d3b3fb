"""Answer loads with quadratic elements on nested levels, each level started from the answer of the one before."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from time import perf_counter

import numpy as np
import pandas as pd

from palpate.benchmark.loads import force_of
from palpate.bodies.body import Body
from palpate.bodies.quadratic import prolongation
from palpate.bodies.refinement import with_midpoints
from palpate.effects.patch_load import patch_at, spread
from palpate.effects.surface_integrals import enclosed_volume
from palpate.errors import NotConverged
from palpate.solvers.equilibrium import FastEquilibrium
from palpate.solvers.newton import Solution, minimise

FIRST = 1e-4
"""Tolerance of the level that starts from rest; what it leaves is smaller than what the next level changes."""
MOST = 8
"""Newton iterations of a level that starts from the one before; 2 to 4 do where the levels converge, and where the body
snaps to another shape, 20 are too few."""

CLOSER = 0.1
"""L-BFGS goes on to this share of a tolerance: it stops where it is asked to, and Newton's last step far below."""


@dataclass(eq=False)
class Ascent:
    """The answers to one load, level by level.

    load : its row of the table; levels : those it is to be answered on, coarse first
    surface : for each level answered so far the displacements (n_surface, 3) [m] of the body's fine surface
    least_det : the least determinant of the deformation gradient at any point of integration of any of them
    volume_change : of the whole body, over its volume at rest, on the last level answered
    iterations, products : iterations of L-BFGS and Newton's method, and multigrid cycles, of all levels together
    clamped : whether a level that started from the one before still met an indefinite Hessian
    failure : why a level has no answer, or ""; then there are no answers of finer ones either
    start : displacements (n, 3) [m] that the next level starts from
    """

    load: pd.Series
    levels: range
    surface: list[np.ndarray] = field(default_factory=list)
    least_det: float = np.inf
    volume_change: float = np.nan
    iterations: int = 0
    products: int = 0
    clamped: bool = False
    failure: str = ""
    seconds: float = 0.0
    start: np.ndarray | None = None


def truth_levels(body: Body) -> range:
    """Return the levels that the truth of ``body`` is found on: three or four, up to one beyond its finest.

    Only levels of the shape of the finest are taken: where a level was moved to the dense surface of a file or a CT,
    those before it are another body's. On a smooth surface with a formula every level lies, finer ones too: facets come
    nearer to it by the order of 2, which Richardson's limit takes up.
    """
    fine = len(body.levels) - 1
    moved = range(fine, 0, -1) if body.smooth is None else ()
    shape = next((level for level in moved if not _is_plain(body, level)), 0)
    first = max(shape, fine - 2)
    return range(first, max(fine + 1, first + 2) + 1)


def ascend(
    body: Body, loads: pd.DataFrame, levels: Sequence[range], tolerance: float, progress: Callable = iter
) -> tuple[list[Ascent], Body]:
    """Solve for every row of ``loads`` on its own ``levels``; return also the body with all levels that were needed.

    tolerance : relative residual of the solutions that start from another level's
    progress : wraps the sequence of all solutions, as ``tqdm`` does
    One level is held in memory at a time. A solution that fails leaves a failure behind and does not raise.
    """
    last = max(own[-1] for own in levels)
    whole = with_midpoints(body, last)
    ascents = [Ascent(load, own) for (_, load), own in zip(loads.iterrows(), levels, strict=True)]
    todo = [(level, each) for level in range(last + 1) for each in ascents if level in each.levels]
    step: _Level | None = None
    for level, each in progress(todo):
        if step is None or step.level != level:
            step = None  # before the next one is made, which is eight times as large
            step = _Level(body, whole, level, level < last)
        if not each.failure:
            step.answer(each, tolerance)
    return ascents, whole


class _Problem(FastEquilibrium):
    """The static problem of quadratic elements, which notes whether the clamped Hessian was needed."""

    clamped = False

    def linearise(self, x: np.ndarray, definite: bool = False) -> tuple:
        """Linearise, and note it if that has to be ``definite``."""
        self.clamped |= definite
        return super().linearise(x, definite)

    def follow(self, load: np.ndarray, tolerance: float, start: np.ndarray) -> Solution:
        """Find the equilibrium under ``load`` (n, 3) [N] near ``start`` (n, 3) [m].

        NotConverged if it is not near: on this level the body has another shape. To search for that, in steps of the
        load from rest, would take minutes and show no limit.
        """

        def newton(begin: np.ndarray | None) -> Solution:
            assert begin is not None
            return minimise(self, begin, self._scale(load), tolerance, MOST)

        return self.descend_or(newton, load, CLOSER * tolerance, start)


class _Level:
    """One level of quadratic elements, and the interpolation to the next if there is one."""

    def __init__(self, body: Body, whole: Body, level: int, goes_on: bool):
        self.level, self._body, self._mesh = level, body, whole.levels[level]
        self._problem = _Problem(whole, level, order=2)
        self._up = prolongation(self._mesh, whole.levels[level + 1]) if goes_on else None

    def answer(self, each: Ascent, tolerance: float) -> None:
        """Solve for one load, and leave behind what the next level starts from."""
        problem, rest = self._problem, self._problem.mesh.nodes
        began, problem.clamped = perf_counter(), False
        start = None if each.start is None else rest + each.start
        try:
            forces = self._forces(each.load)
            solution = (
                problem.solve(forces, CLOSER * FIRST) if start is None else problem.follow(forces, tolerance, start)
            )
        except NotConverged as failure:
            each.failure, each.start = f"no answer on level {self.level}: {failure}", None
            return
        finally:
            each.seconds += perf_counter() - began
        each.clamped |= start is not None and problem.clamped
        x = solution.x
        each.iterations += solution.iterations
        each.products += solution.products
        each.least_det = min(each.least_det, problem.least_det(x))
        each.volume_change = enclosed_volume(self._mesh, x) / enclosed_volume(self._mesh, rest) - 1.0
        fine = moved = x - rest
        each.start = None
        if self._up is not None:
            each.start = finer = self._up @ moved
            fine = moved if len(moved) >= len(self._body.fine.nodes) else finer
        each.surface.append(fine[self._body.fine.surface])

    def _forces(self, load: pd.Series) -> np.ndarray:
        """Return the nodal forces (n, 3) [N]; the patch is that of the body, the same for all levels."""
        patch = patch_at(self._body, int(load["contact"]), float(load["radius_m"]))
        return spread(self._mesh, patch, force_of(load), order=2)


def _is_plain(body: Body, level: int) -> bool:
    """Return whether the nodes of a level are midpoints of edges of the level before."""
    nodes = body.prolongations[level - 1] @ body.levels[level - 1].nodes
    return bool(np.allclose(nodes, body.levels[level].nodes, rtol=0.0, atol=1e-9 * body.coarse.size))
