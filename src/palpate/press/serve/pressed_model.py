"""Read the presses that a page asks for, and ask a prepared model for them anywhere on the surface.

Between the nodes, too, answers do not jump; whatever else was sent is refused in one sentence.
"""

import json
from itertools import product
from math import prod
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from palpate.benchmark.load import Load, Press
from palpate.benchmark.model import Case, Solver, answered
from palpate.effects.patch_load import Patch
from palpate.errors import InputError

MOST_PRESSES = 4
"""Presses at once: two hands have four fingers to spare."""
ROUNDING = 1e-3
"""What the sum of weights may differ from 1, as it was rounded on its way."""


class Asked(NamedTuple):
    """One press: a triangle of the surface at rest, weights (3,) of its corners, force (3,) [N] or way (3,) [m]."""

    triangle: int
    weights: np.ndarray
    force: np.ndarray | None
    moved: np.ndarray | None


class Bounds(NamedTuple):
    """Limit presses of a body: its number of triangles, the largest force [N] and way [m]."""

    triangles: int
    force: float
    moved: float


def read_presses(body: bytes, bounds: Bounds) -> list[Asked]:
    """Read the presses of a request ``{"presses": [...]}``, which may have ``cuts``; InputError for another form."""
    try:
        request = json.loads(body)
        if set(request) - {"cuts"} != {"presses"} or not isinstance(request["presses"], list):
            raise TypeError
        presses = [_press(each, bounds) for each in request["presses"]]
    except InputError:
        raise
    except (ValueError, TypeError, OverflowError, RecursionError):
        raise InputError('post {"presses": [...]}, each with triangle, weights, and force or moved.') from None
    if not 1 <= len(presses) <= MOST_PRESSES:
        raise InputError(f"there are {len(presses)} presses; post 1 to {MOST_PRESSES}.")
    return presses


def _press(sent: Any, bounds: Bounds) -> Asked:
    """Read one press; TypeError or ValueError for another form, InputError for one beyond the bounds."""
    name = "force" if "force" in sent else "moved"
    if set(sent) != {"triangle", "weights", name} or type(sent["triangle"]) is not int:
        raise TypeError
    weights, vector = (np.array(sent[key], dtype=float) for key in ("weights", name))
    if weights.shape != (3,) or vector.shape != (3,):
        raise TypeError
    if not 0 <= sent["triangle"] < bounds.triangles:
        raise InputError(f"a press is on no triangle of the body; give a number from 0 to {bounds.triangles - 1}.")
    # comparisons that NaN fails
    if not (weights.min() >= -ROUNDING and abs(weights.sum() - 1.0) <= ROUNDING):
        raise InputError("weights of a press are not three shares whose sum is 1.")
    bound = bounds.force if name == "force" else bounds.moved
    if not (np.abs(vector).max() < 1e9 and np.linalg.norm(vector) <= bound):
        raise InputError(f"{name} of a press is larger than this body can bear; give {bound:.2g} at most.")
    weights = weights.clip(0.0)
    return Asked(sent["triangle"], weights / weights.sum(), *((vector, None) if name == "force" else (None, vector)))


class Found(NamedTuple):
    """An answer: displacement (n, 3) [m] of the surface, forces (k, 3) [N], the model's own estimate of its error.

    doubt : why the model does not believe it, or ""; milliseconds : what it took
    """

    displacement: np.ndarray
    forces: np.ndarray
    error: float | None
    doubt: str
    milliseconds: float


class PressedModel:
    """A prepared model that answers presses anywhere on the surface, continuously as a finger slides.

    Finite elements press a disc at the very place. Any other model answers at the corners of the triangle, and its
    answers are blended with the weights of the corners: at a corner the blend is the corner's answer.
    """

    def __init__(self, case: Case, solver: Solver):
        fine = case.body.fine
        self._case, self._solver = case, solver
        self._corners = fine.surface[case.database.triangles]
        self._nodes, self._normals = fine.nodes, fine.normals
        self._held = set(case.body.anchors[len(case.body.levels) - 1].tolist())
        self._places = solver.presses_anywhere

    def respond(self, presses: list[Asked]) -> Found:
        """Answer presses; NotConverged where there is no answer, InputError for a place that cannot be pressed."""
        begin = perf_counter()
        free_corners = [self._free_corners(each) for each in presses]
        if self._places:
            nodes = [self._solver.place(row, self._disc(each)) for row, each in enumerate(presses)]
            weighted_answers = [(1.0, self._ask(presses, nodes))]
        else:
            weighted_answers = [
                (prod(weight for _, weight in corners), self._ask(presses, [node for node, _ in corners]))
                for corners in product(*free_corners)
            ]
        displacement = np.sum([weight * answer.displacement for weight, answer in weighted_answers], axis=0)
        forces = np.sum([weight * answer.forces for weight, answer in weighted_answers], axis=0)
        errors = [answer.error for _, answer in weighted_answers if answer.error is not None]
        doubt = next((answer.doubt for _, answer in weighted_answers if answer.doubt), "")
        taken_ms = 1e3 * (perf_counter() - begin)
        return Found(displacement, forces, max(errors, default=None), doubt, taken_ms)

    def _free_corners(self, request: Asked) -> list[tuple[int, float]]:
        """Return the corners of a press's triangle that are not held, by node, with their weights in the blend."""
        corners = zip(self._corners[request.triangle].tolist(), request.weights.tolist(), strict=True)
        free = [(node, weight) for node, weight in corners if weight > 0.0 and node not in self._held]
        if not free:
            raise InputError("the body is held there; press another place.")
        total = sum(weight for _, weight in free)
        return [(node, weight / total) for node, weight in free]

    def _disc(self, request: Asked) -> Patch:
        corners = self._corners[request.triangle]
        normal = request.weights @ self._normals[corners]
        return Patch(request.weights @ self._nodes[corners], normal / np.linalg.norm(normal), self._case.radius_m)

    def _ask(self, presses: list[Asked], nodes: list[int]) -> Found:
        """Ask the model for presses at ``nodes``."""
        load = Load(tuple(Press(node, each.force, each.moved) for node, each in zip(nodes, presses, strict=True)))
        answer, doubt = answered(self._solver, load, self._case.n_surface)
        if answer.forces is None and any(each.force is None for each in presses):
            raise InputError("this model finds no force for a depth; press with a force.")
        forces = answer.forces if answer.forces is not None else np.array([each.force for each in presses])
        return Found(answer.displacement, forces, answer.error, doubt, 0.0)
