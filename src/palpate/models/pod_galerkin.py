"""Answer with one reduced model of the whole body: POD modes of the samples, and few cubature points for its energy.

Proper orthogonal decomposition, a Galerkin projection, and energy-conserving sampling and weighting (Farhat, Avery,
Chapman and Cortial 2014): the textbook's way, whose modes have to serve contacts that no sample has pressed.
"""

import numpy as np

from palpate.benchmark.load import Answer, Doubted, Load, loads_of
from palpate.benchmark.model import Case, Solver, held_mb
from palpate.errors import NotConverged
from palpate.models import kinds
from palpate.models.contact_modes.elements_at_rest import ElementsAtRest
from palpate.models.contact_modes.offline import Offline, reduced_level
from palpate.models.fem_statics import ContactShares, Simulation
from palpate.models.near_buckling import NearBuckling
from palpate.models.reduced.basis import independent, products
from palpate.models.reduced.cubature import hyper_reduced, points_and_means
from palpate.models.reduced.energy import ReducedEnergy, softness
from palpate.solvers.equilibrium import FastEquilibrium

RESIDUAL = 1e-3
"""Residual of an answer over its load, and of the volume that is found to a sample."""
CHOOSING_SAMPLES, PARTS = 8, (1.0, 0.5)
"""Samples, spread over all, that cubature points are chosen by, and the parts of their way at which cubature points
pull as all do."""
LEAST_DET, LARGEST_NORM, LEAST_STIFFNESS = 0.4, 2.0, 0.15
"""Smallest det F of an answer's cubature points, its largest energy norm over that of the farthest sample, and its
least stiffness over that of the softest motion at rest; beyond any the model says that it does not know."""
LARGEST_SHARE = 0.9
"""Share of the buckling load, as samples may lack the buckled shape, above which the model doubts."""


class Galerkin(Solver):
    """A Galerkin projection of quadratic elements; on the surface its modes are those of the samples themselves.

    NotConverged if no sample settles.
    """

    def __init__(self, case: Case, model: kinds.PODGalerkin):
        database = case.use_training()
        what = case.body, case.radius_m, reduced_level(case.body, model.nodes)
        offline = case.share(("galerkin", *what), lambda: Offline(*what))
        name = "volumes", case.database, case.radius_m, offline.level
        displacements, rows = case.share(name, lambda: _volumes(case, offline.level), "volumes")
        elements = offline.elements(offline.level)
        answers = np.stack(displacements, axis=2)
        energies = products(answers, elements.multiply(answers))
        mixes = independent(energies)[
            :, -model.modes :
        ]  # weights of the answers in each mode, each answer over its energy
        coordinates = mixes.T @ energies
        self._modes = answers @ mixes
        self._surface = np.tensordot(database.fine[rows], mixes, (0, 0)).reshape(-1, mixes.shape[1])
        self._soft = softness(self._surface.reshape(-1, 3, mixes.shape[1]))
        self._shares, self._buckling = ContactShares(case, offline.level, 2), NearBuckling(case, LARGEST_SHARE)
        # the samples' loads in coordinates, by which cubature points are chosen
        self._pulls: dict[int, np.ndarray] = {}
        loads = zip(database.contact[rows], database.force[rows], strict=True)
        pulls = np.stack([force @ self._pull(int(contact)) for contact, force in loads], axis=1)
        self._reduced = _reduced(elements, self._modes, coordinates, pulls, model.thinned)
        self._reach = float(np.linalg.norm(coordinates, axis=0).max())
        for contact in case.prepared_contacts:  # computed now, so that no press has to
            self._pull(int(contact))

    @property
    def memory_mb(self) -> float:
        """The memory [MB] held for queries, with the modes of all nodes that places never prepared need."""
        return held_mb((self._modes, self._reduced, self._surface, self._pulls, self._buckling))

    def respond(self, load: Load) -> np.ndarray | Answer:
        """Return the displacement (n_surface, 3) [m] under ``load``; Doubted beyond what the modes were made of."""
        pull = np.sum([force @ self._pull(node) for node, force in load.forces()], axis=0)
        q, residual, least_det = self._reduced.at_rest(pull, RESIDUAL)
        moved, norm_ratio = (self._surface @ q).reshape(-1, 3), float(np.linalg.norm(q)) / self._reach
        doubt = ""
        if not least_det >= LEAST_DET:
            doubt = f"cells are squeezed to det F = {least_det:.2f}, beyond what the modes are made of"
        elif not norm_ratio <= LARGEST_NORM:
            doubt = f"this goes {norm_ratio:.1f} times as far as any sample, beyond what is known"
        elif not self._reduced.is_stiff(q, LEAST_STIFFNESS * self._soft):
            doubt = "the body is about to give way"
        if doubt:
            raise Doubted(doubt, [residual], Answer(moved))
        return self._buckling.checked(load, moved)

    def _pull(self, node: int) -> np.ndarray:
        """Return unit forces on the disc around fine surface ``node`` in coordinates, (3, r)."""
        if node not in self._pulls:
            nodes, shares = self._shares.of(node)
            self._pulls[node] = np.tensordot(shares, self._modes[nodes], 1)
        return self._pulls[node]


def _volumes(case: Case, level: int) -> tuple[list[np.ndarray], np.ndarray]:
    """Return displacements (n, 3) [m] of all nodes of quadratic elements under training samples' loads, and the rows.

    A database has displacements of the surface only. Samples without an answer are left out; NotConverged if all are.
    """
    db = case.database
    simulation = Simulation(case, level, RESIDUAL, None, 2, FastEquilibrium)
    answers, rows = [], []
    for row, load in enumerate(loads_of(db.contact, db.force)):
        try:
            moved = simulation.displacement(load)
        except NotConverged:
            continue
        if moved.any():
            answers.append(moved)
            rows.append(row)
    if not answers:
        raise NotConverged("no training sample has an answer on the level that is reduced", [float("nan")])
    return answers, np.array(rows)


def _reduced(
    elements: ElementsAtRest, modes: np.ndarray, coordinates: np.ndarray, pulls: np.ndarray, tolerance: float
) -> ReducedEnergy:
    """Return the energy of few points in ``modes`` (n, 3, r), whose forces at the samples are those of all points.

    coordinates, pulls : (r, s) of the samples, and their loads in coordinates
    tolerance : relative to the whole forces, or to their nonlinear part where that is larger, as in a body that turns
    """
    points = points_and_means(elements, modes, np.ones(len(elements.couples), dtype=bool))
    model = ReducedEnergy(points, np.eye(modes.shape[2]), elements.law)
    if tolerance == 0.0:
        return model
    chosen = np.unique(np.linspace(0, coordinates.shape[1] - 1, CHOOSING_SAMPLES).round().astype(int))
    nonlinear_norms = np.linalg.norm(pulls - coordinates, axis=0)[chosen]
    share = float(np.min(np.linalg.norm(pulls, axis=0)[chosen] / np.maximum(nonlinear_norms, 1e-300)))
    states = np.array([part * q for q in coordinates.T[chosen] for part in PARTS])
    return hyper_reduced(model, states, min(1.0, share) * tolerance)


prepare = Galerkin
