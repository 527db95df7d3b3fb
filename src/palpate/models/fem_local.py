"""Answer with finite elements that are fine near the contact only, and coarse elsewhere.

The thesis (paper 3) reports this of Bao and others (2006): a fine model only where force acts. Each contact has a mesh
of its own, made in advance for the prepared ones, and at the first query for others.
"""

from dataclasses import replace

import numpy as np
from scipy import sparse

from palpate.benchmark.load import Answer, Load
from palpate.benchmark.model import Case, Solver
from palpate.bodies.contacts import contacts_of, row_of
from palpate.bodies.fine_surface_map import FineSurfaceMap
from palpate.bodies.local_refinement import LocalRefinement
from palpate.models import kinds
from palpate.models.fem import FrameBefore, Rest
from palpate.models.fem_statics import Simulation


class LocalFem(Solver):
    """Finite elements on a mesh for each contact, brought to the fine surface with their own shape functions."""

    def __init__(self, case: Case, model: kinds.LocalFEM):
        mesh = model.depth, model.reach, model.order
        name = "meshes of contacts", case.body, case.radius_m, case.tolerance, case.response, *mesh
        self._meshes = case.share(name, lambda: _Meshes(case, *mesh), "meshes")
        self._stop = model.tolerance or case.tolerance, model.iterations
        start = FrameBefore if model.start == "frame" else Rest
        self._start = start(case, self._meshes, mesh)

    def precede(self, load: Load) -> None:
        self._start.precede(load)

    def respond(self, load: Load) -> np.ndarray | Answer:
        """Return the displacement (n_surface, 3) [m] under one press, by force or to a depth; errors as ``Solver``."""
        simulation, up = self._meshes.of(load.alone().node)
        moved, forces = simulation.stopped(*self._stop).answer(load, self._start.at(load))
        return up @ moved if forces is None else Answer(up @ moved, forces)


class _Meshes:
    """The locally refined mesh of each contact: its simulation, and the interpolation to the fine surface.

    depth : how many of the body's levels are refined; reach : radius of what is refined, over that of the patch
    order : of the elements
    """

    def __init__(self, case: Case, depth: int, reach: float, order: int):
        # without what models learn from, and without prepared contacts: patches are integrated where they are needed
        self._case = replace(case, response=None, database=case.meshes)
        self._depth, self._radius_m, self._order = depth, reach * case.radius_m, order
        self._refinement, self._surface = LocalRefinement(case.body, depth), FineSurfaceMap(case.body)
        self._contacts = contacts_of(case.body)
        self._made: dict[int, tuple[Simulation, sparse.csr_array]] = {}
        for contact in case.prepared_contacts:
            self.of(int(contact))

    def of(self, contact: int) -> tuple[Simulation, sparse.csr_array]:
        """Return the simulation on the mesh of ``contact`` and its interpolation; InputError for a bad contact."""
        if contact not in self._made:
            row_of(self._contacts, contact)
            center = self._case.body.fine.nodes[contact]
            local = self._refinement.around(center, self._radius_m)
            case = replace(self._case, body=local)
            simulation = Simulation(case, self._depth, case.tolerance, order=self._order)
            self._made[contact] = simulation, self._surface.of(local, self._order)
        return self._made[contact]

    def settled(self, load: Load) -> np.ndarray:
        """Return displacements (n_nodes, 3) [m] on the mesh of the one contact, converged to the case's tolerance."""
        return self.of(load.alone().node)[0].settled(load)


prepare = LocalFem
