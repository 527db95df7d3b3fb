"""Ask for more than one force at a prepared contact, and know the answer: the fine operator's own, converged."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from palpate.benchmark.accuracy import patch_nodes
from palpate.benchmark.judge import Judge
from palpate.benchmark.load import Load, Press
from palpate.benchmark.model import Case
from palpate.benchmark.static_responses import NESTED
from palpate.bodies.contacts import places_between
from palpate.bodies.refinement import quadratic_prolongation
from palpate.errors import NotConverged
from palpate.models.fem_statics import Simulation
from palpate.solvers.equilibrium import FastEquilibrium

PREPARED, NEW, TWO, DEPTH = "prepared", "never prepared", "two contacts", "depth"
KINDS = (PREPARED, NEW, TWO, DEPTH)
SHARE = 0.7
"""Part of its own force that each of two presses has, so that both together squeeze no element that one would not."""
APART = 2.0
"""Radii that two contacts are apart at least: their patches do not overlap."""


class Question(NamedTuple):
    """A load of one of KINDS, and the fine operator's answer.

    truth : displacement (n_surface, 3) [m]; forces : (presses, 3) [N]; patch : (n_surface,) the nodes that are pressed
    """

    kind: str
    load: Load
    truth: np.ndarray
    forces: np.ndarray
    patch: np.ndarray


def questions(case: Case, judge: Judge, count: int, tolerance: float, progress: Callable = iter) -> list[Question]:
    """Ask ``count`` questions of each kind, fewer where there are fewer test samples or an element is inverted.

    tolerance : relative residual of the answers; progress : wraps the loads that have to be solved
    Prepared contacts are those of test samples, whose answers are known. Places never prepared are fine surface nodes
    far from all prepared contacts, pressed inward with the force of the nearest sample. Two contacts are a test
    sample's and the nearest one that is APART. A depth is how far a test sample's force moves its disc.
    """
    tests = np.flatnonzero(judge.side == "test")
    chosen = tests[np.unique(np.linspace(0, len(tests) - 1, count).round().astype(int))]
    samples, operator = judge.samples, Operator(case, tolerance)
    alone = [Load.at(samples.contact[i], samples.force[i]) for i in chosen]
    found = [_question(case, PREPARED, load, samples.fine[i]) for i, load in zip(chosen, alone, strict=True)]
    asked = [(NEW, load) for load in _between(case, judge, count)]
    asked += [(TWO, load) for load in _pairs(case, judge, chosen)] + [(DEPTH, load) for load in alone]
    for kind, load in progress(asked):
        try:
            surface, ways = operator.answer(load)
        except NotConverged:
            continue
        deep = Load(tuple(Press(p.node, moved=way) for p, way in zip(load.presses, ways, strict=True)))
        found.append(_question(case, kind, load, surface, deep if kind == DEPTH else load))
    return found


class Operator:
    """Quadratic elements on the body's finest level, as samples are simulated with: from the level before."""

    def __init__(self, case: Case, tolerance: float):
        body, last = case.body, len(case.body.levels) - 1
        bare = replace(case, response=None)  # patches are integrated where they are needed
        self._fine = Simulation(bare, last, tolerance, order=2, solver=FastEquilibrium)
        self._coarse = Simulation(bare, last - 1, max(tolerance, NESTED), order=2, solver=FastEquilibrium)
        self._up = quadratic_prolongation(body.levels[last - 1], body.levels[last])
        self._surface = body.fine.surface

    def answer(self, load: Load) -> tuple[np.ndarray, np.ndarray]:
        """Return displacements (n_surface, 3) [m] of the fine surface, and means (presses, 3) [m] of the discs.

        Raises NotConverged, also where an element is inverted: such a load has no answer to be judged by.
        """
        moved = self._fine.displacement(load, self._up @ self._coarse.displacement(load))
        if not self._fine.least_det(moved) > 0.0:
            raise NotConverged("an element is inverted", [float("nan")])
        return moved[self._surface], self._fine.means(load, moved)


def _question(case: Case, kind: str, given: Load, truth: np.ndarray, asked: Load | None = None) -> Question:
    """Put a question about a load by its forces, or as it is ``asked`` for by depths."""
    body, nodes = case.body, [press.node for press in given.presses]
    patch = np.any([patch_nodes(body.fine, node, case.radius_m) for node in nodes], axis=0)
    forces = np.array([force for _, force in given.forces()])
    return Question(kind, given if asked is None else asked, truth, forces, patch)


def _between(case: Case, judge: Judge, count: int) -> Iterator[Load]:
    body = case.body
    contact, force = (
        np.concatenate([getattr(d, n) for d in (case.database, judge.samples)]) for n in ("contact", "force")
    )
    known = case.prepared_contacts if len(case.prepared_contacts) else np.unique(contact)
    for node in places_between(body, count, known):
        near = np.argmin(np.linalg.norm(body.coarse.nodes[contact] - body.fine.nodes[node], axis=1))
        yield Load.at(int(node), -np.linalg.norm(force[near]) * body.fine.normals[node])


def _pairs(case: Case, judge: Judge, chosen: np.ndarray) -> Iterator[Load]:
    nodes, samples = case.body.coarse.nodes, judge.samples
    for i in chosen:
        away = np.linalg.norm(nodes[samples.contact] - nodes[samples.contact[i]], axis=1)
        away[away < APART * max(case.radius_m, 1e-9)] = np.inf
        if np.isfinite(away).any():
            pair = (i, int(np.argmin(away)))
            yield Load(tuple(Press(int(samples.contact[j]), SHARE * samples.force[j]) for j in pair))
