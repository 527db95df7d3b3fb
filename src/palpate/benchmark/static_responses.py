"""Simulate the static response of a body to each load of a table, and assemble the database from both meshes'."""

import hashlib
import json
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from palpate.benchmark.database import Database, database_of, fold_table, sample_table
from palpate.benchmark.presses import FORCES, Sample, samples_in
from palpate.bodies.body import Body
from palpate.bodies.contacts import contacts_of, row_of
from palpate.bodies.mesh import Mesh
from palpate.bodies.refinement import (
    QUADRATURE_POINTS,
    quadratic_gradients,
    quadratic_prolongation,
    ten_nodes,
    with_midpoints,
)
from palpate.effects.elements import shape_gradients
from palpate.errors import InputError, NotConverged
from palpate.linalg.minimiser import Solution
from palpate.solvers.equilibrium import Equilibrium, FastEquilibrium
from palpate.solvers.stability import FIRM

NESTED = 1e-4
"""Relative residual of the solution on the level before, from which one of quadratic elements starts."""


@dataclass(frozen=True, eq=False)
class Responses:
    """Responses of one level of a body to k loads.

    sample : (k,) numbers from the load table
    displacement : (k, n_nodes, 3) [m], of quadratic elements at the nodes of their level only
    newton_iterations : (k,) of L-BFGS and Newton's method; linear_solves : (k,) of the latter
    residual : (k,) relative, of each solution; seconds : (k,) that it took [s]
    least_det, inverted : (k,) the smallest det F, and the number of elements in which it is not positive
    """

    sample: np.ndarray
    displacement: np.ndarray
    newton_iterations: np.ndarray
    linear_solves: np.ndarray
    residual: np.ndarray
    seconds: np.ndarray
    least_det: np.ndarray
    inverted: np.ndarray

    def costs(self) -> pd.DataFrame:
        """Tabulate one row a sample: newton_iterations, linear_solves, residual, seconds."""
        names = ["sample", "newton_iterations", "linear_solves", "residual", "seconds"]
        return pd.DataFrame({name: getattr(self, name) for name in names})


def press(
    body: Body, level: int, loads: pd.DataFrame, tolerance: float, progress: Callable = iter, order: int = 1
) -> Responses:
    """Solve for every row of ``loads`` on one level, to the relative residual ``tolerance``.

    order : 1 for linear elements, 2 for quadratic ones, whose solutions start from those on the level before
    progress : wraps the sequence of rows, as ``tqdm`` does
    Warns of samples with inverted quadratic elements; linear ones, as under the paper's point forces, are counted only.
    Raises InputError for a contact that cannot be pressed, NotConverged naming the sample.
    """
    contacts = contacts_of(body)
    for contact in loads["contact"]:
        row_of(contacts, int(contact), f"{body.name}, ")
    level %= len(body.levels)
    solver = StaticSolver(body, level, order)
    solved = []
    for sample in progress(samples_in(loads)):
        try:
            solved.append(solver.solve(sample, tolerance))
        except NotConverged as failure:
            raise NotConverged(
                f"{body.name}, sample {sample.number}: {failure}; lower the regime's peak_of_size, at which "
                "tissue may be pressed flat, or hold the body elsewhere (anchors).",
                failure.history,
            ) from failure
    n_nodes = len(body.levels[level].nodes)
    solutions = [solution for solution, _ in solved]
    responses = Responses(
        loads["sample"].to_numpy(),
        np.array([each.x[:n_nodes] for each in solutions]) - body.levels[level].nodes,
        np.array([each.iterations for each in solutions]),
        np.array([each.linear_solves for each in solutions]),
        np.array([each.history[-1] for each in solutions]),
        np.array([each.seconds[-1] for each in solutions]),
        *(np.array(values) for values in zip(*(det_and_inverted for _, det_and_inverted in solved), strict=True)),
    )
    if order == 2:
        _warn_of_inverted(body.name, responses)
    return responses


class StaticSolver:
    """Solves static problems of one body on one level, with quadratic elements by way of the level before.

    On the finest level, with quadratic elements, its solutions are the reference for models.
    """

    def __init__(self, body: Body, level: int, order: int):
        self._body, self._order = body, order
        self._levels = [level - 1, level] if order == 2 and level > 0 else [level]
        solver_class = FastEquilibrium if order == 2 else Equilibrium
        with_edges = with_midpoints(body, level) if order == 2 else body
        self._problems = [solver_class(with_edges, each_level, order) for each_level in self._levels]
        for problem in self._problems:  # compiled before the clock runs
            rest = problem.mesh.nodes
            if order == 2:
                problem.approach(np.full_like(rest, 1e-9), 0.0, 1)
            else:
                problem.energy(rest), problem.linearise(rest)
        self.mesh = problem.mesh
        if len(self._levels) == 2:
            self._up = quadratic_prolongation(body.levels[level - 1], body.levels[level])

    def solve(self, sample: Sample, tolerance: float) -> tuple[Solution, tuple[float, int]]:
        """Return a sample's equilibrium, least det F and count of inverted elements; each level starts the next."""
        solution, start, seconds, start_is_stable = None, None, 0.0, False
        for level, problem in zip(self._levels, self._problems, strict=True):
            if solution is not None:
                start = problem.mesh.nodes + self._up @ (solution.x - self._problems[0].mesh.nodes)
                seconds = solution.seconds[-1]
            nodal = sample.nodal(self._body, level, self._order)
            is_last = level == self._levels[-1]
            search = problem.settle if start_is_stable else problem.solve
            solution = search(nodal, tolerance if is_last else max(tolerance, NESTED), start)
            start_is_stable = bool(not is_last and nodal.any() and problem.softness(solution.x) >= FIRM)
        assert solution is not None
        solution.seconds[-1] += seconds
        least_det = problem.least_det(solution.x)
        count = 0 if least_det > 0.0 else inverted(self._body.levels[level], solution.x, self._order)
        return solution, (least_det, count)


def inverted(mesh: Mesh, x: np.ndarray, order: int = 1) -> int:
    """Count the elements of ``mesh`` with a point at which det F is not positive, at positions ``x`` (n, 3) [m]."""
    gradients, _ = shape_gradients(mesh)
    linear_elements = mesh.tetrahedra, np.eye(4)[None]
    elements, slopes = linear_elements if order == 1 else (ten_nodes(mesh), quadratic_gradients(QUADRATURE_POINTS))
    deformation_gradients = np.einsum("eai,qac,ecj->eqij", x[elements], slopes, gradients, optimize=True)
    return int((np.linalg.det(deformation_gradients) <= 0.0).any(axis=1).sum())


def _warn_of_inverted(name: str, responses: Responses) -> None:
    if count := int(np.count_nonzero(responses.inverted)):
        warnings.warn(
            f"bodies.{name}: in {count} of {len(responses.inverted)} samples an element is inverted, so that they are "
            "no reference; lower the regime's peak_of_size or pressure_of_young, or give a larger radius_m.",
            stacklevel=3,
        )


def press_batch(
    body: Body,
    loads: pd.DataFrame,
    batch: int,
    samples_per_job: int,
    tolerance: float,
    order: int,
    progress: Callable = iter,
) -> Responses:
    """Solve for one of the batches of ``samples_per_job`` rows of ``loads`` on the finest level, as ``press``."""
    rows = loads.iloc[batch * samples_per_job : (batch + 1) * samples_per_job]
    return press(body, len(body.levels) - 1, rows, tolerance, progress, order)


def assemble_database(
    body: Body,
    loads: pd.DataFrame,
    fine: list[Responses],
    tolerance: float,
    settings: dict,
    split: list[int],
    seed: int,
    progress: Callable = iter,
) -> dict[str, Database | pd.DataFrame]:
    """Simulate the coarse responses to ``loads``; return the ``database`` with the fine ones, and its ``samples``.

    fine : in parts, in the order of ``loads``; settings : that all this follows from
    split : numbers of samples that train and test paper 1's methods; none for presses, which are dealt into folds
    """
    fine_responses = Responses(*map(np.concatenate, zip(*(vars(part).values() for part in fine), strict=True)))
    coarse_responses = press(body, 0, loads, tolerance, progress)
    db = assemble(body, loads, fine_responses, coarse_responses, digest(settings))
    if not split:
        return {"database": db, "samples": fold_table(db, seed)}
    train, test = split
    return {"database": db, "samples": sample_table(db, train, test, seed)}


def assemble(body: Body, loads: pd.DataFrame, fine: Responses, live: Responses, digest: str) -> Database:
    """Return the database of k loads from the responses of both meshes.

    fine, live : responses of the fine and of the coarse mesh to ``loads``, in the same order
    digest : of the settings that they were made with
    The paper's coarse displacements are the fine ones at the coarse nodes. InputError for responses to other loads, or
    of other meshes.
    """
    for name, responses, mesh in (("fine", fine, body.fine), ("coarse", live, body.coarse)):
        if (
            not np.array_equal(responses.sample, loads["sample"])
            or responses.displacement.shape[1:] != mesh.nodes.shape
        ):
            raise InputError(f"{body.name}: the {name} responses are not those to the loads; simulate them again.")
    db = database_of(body, loads["contact"].to_numpy(), loads[FORCES].to_numpy(), live.displacement, fine.displacement)
    return replace(db, residual=fine.residual, seconds=fine.seconds + live.seconds, config_digest=digest)


def digest(settings: dict) -> str:
    """Return a short hash of ``settings``, which changes with any of them."""
    return hashlib.sha256(json.dumps(settings, sort_keys=True, default=str).encode()).hexdigest()[:16]
