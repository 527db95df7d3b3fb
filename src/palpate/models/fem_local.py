"""Answer with finite elements that are fine near the contact only, and coarse elsewhere.

The thesis (paper 3) reports this of Bao and others (2006): a fine model only where force acts. Each contact has a mesh
of its own, made in advance for the prepared ones, and at the first query for others.
"""

from dataclasses import replace
from time import perf_counter

import numpy as np
from scipy import sparse

from palpate.benchmark.load import Answer, Load
from palpate.benchmark.model import Case, Setting, Solver, Stage
from palpate.bodies.body import Body
from palpate.bodies.contacts import contacts_of, row_of
from palpate.bodies.local_refinement import LocalBody, LocalRefinement
from palpate.effects.surface_integrals import surface_interpolation
from palpate.models.fem import FrameBefore, Rest
from palpate.models.fem_statics import Simulation

_ROUNDING = 1e-9
"""Coordinates above minus this count as inside; they are multiples of a power of 2, or at least 0.25 outside."""


class SurfaceMap:
    """Places of the fine surface nodes in the coarse triangles, which every local mesh of a body splits further.

    They are found by the prolongation, not by rest positions, which may have moved to a smooth surface.
    """

    def __init__(self, body: Body):
        first = np.unique(body.fine.triangles, return_index=True)[1]
        self._coarse_nodes = len(body.coarse.nodes)
        sides = _sides(body.prolongation, body.fine.triangles)[first // 3]
        self._keys, self._places = self._key(sides), _coordinates(body.prolongation, body.fine.surface, sides)

    def of(self, local: LocalBody, order: int) -> sparse.csr_array:
        """Return the interpolation (n_surface, n_unknowns) with the shape functions of elements on ``local``.

        Those of ``order`` 2 have the nodes and the edge midpoints of its finest level.
        """
        numbers, weights = local.fine.triangles, local.prolongation
        sides = _sides(weights, numbers)
        keys = self._key(sides)
        ranked = np.argsort(keys, kind="stable")
        first, last = (np.searchsorted(keys[ranked], self._keys, side) for side in ("left", "right"))
        node = np.repeat(np.arange(len(self._keys)), last - first)
        among = np.arange(len(node)) - np.repeat(np.cumsum(last - first) - (last - first), last - first)
        triangle = ranked[np.repeat(first, last - first) + among]
        corners = np.stack([_coordinates(weights, numbers[:, i], sides) for i in range(3)], axis=2)
        inside = np.linalg.solve(corners[triangle], self._places[node][:, :, None])[:, :, 0]
        kept = np.flatnonzero(inside.min(axis=1) > -_ROUNDING)
        chosen = kept[np.unique(node[kept], return_index=True)[1]]
        return surface_interpolation(local.fine, triangle[chosen], inside[chosen], order)

    def _key(self, sides: np.ndarray) -> np.ndarray:
        return (sides[:, 0].astype(np.int64) * self._coarse_nodes + sides[:, 1]) * self._coarse_nodes + sides[:, 2]


def _sides(weights: sparse.csr_array, triangles: np.ndarray) -> np.ndarray:
    """Return the coarse triangles (m, 3), by their nodes, that ``triangles`` (m, 3) of finer nodes are parts of.

    weights : (n_finer, n_coarse), the linear interpolation from the coarse nodes
    """
    rows = np.repeat(np.arange(len(triangles)), 3)
    means = sparse.csr_array((np.ones(triangles.size), (rows, triangles.ravel())), (len(triangles), weights.shape[0]))
    corners = (means @ weights).tocsr()
    corners.sort_indices()
    return corners.indices.reshape(-1, 3)


def _coordinates(weights: sparse.csr_array, nodes: np.ndarray, sides: np.ndarray) -> np.ndarray:
    """Return the coordinates (m, 3) of finer ``nodes`` (m,) in coarse triangles ``sides`` (m, 3)."""
    return weights[nodes[:, None], sides].toarray()


PREPARED, LAW = True, "the body's"


def settings(case: Case) -> list[Setting]:
    """List the meshes from small to large; each is stopped early from the frame before, and solved from rest."""
    grid, finest = case.grid["fem_local"], len(case.body.levels) - 1
    ends: list[Setting] = [{"start": "frame", "iterations": n} for n in grid["warm_iterations"]]
    ends += [{"start": "rest", "tolerance": tolerance} for tolerance in grid["tolerances"]]
    return [mesh | end for mesh in grid["meshes"] if mesh["depth"] <= finest for end in ends]


class Offline(Stage):
    """Meshes of contacts, by depth, reach and order: one serves all settings that have them."""

    def __init__(self, case: Case):
        super().__init__(case)
        self._meshes: dict[tuple, _Meshes] = {}

    def online(self, setting: Setting) -> "LocalFem":
        """Make the mesh of each prepared contact, and matrix patterns and the preconditioner on it."""
        mesh = setting["depth"], setting["reach"], setting["order"]
        if mesh not in self._meshes:
            self._meshes[mesh] = _Meshes(self.case, *mesh)
        self._meshes[mesh].prepare(self.case)
        return LocalFem(self.case, setting, self._meshes[mesh], mesh)


class LocalFem(Solver):
    """Finite elements on a mesh for each contact, brought to the fine surface with their own shape functions."""

    def __init__(self, case: Case, setting: Setting, meshes: "_Meshes", mesh: tuple[float, ...]):
        self._meshes = meshes
        self._stop = setting.get("tolerance", case.tolerance), setting.get("iterations")
        start = FrameBefore if setting["start"] == "frame" else Rest
        self._start = start(case, self._meshes, mesh)

    def precede(self, load: Load) -> None:
        self._start.precede(load)

    def respond(self, load: Load) -> np.ndarray | Answer:
        """Return the displacement (n_surface, 3) [m] under one press, by force or to a depth; errors as ``Solver``."""
        simulation, up = self._meshes.of(load.alone().node)
        moved, forces = simulation.stopped(*self._stop).answer(load, self._start.at(load))
        return up @ moved if forces is None else Answer(up @ moved, forces)


class _Meshes:
    """The mesh of each contact that was asked for: its simulation, and the map to the fine surface.

    depth : how many of the body's levels are refined; reach : radius of what is refined, over that of the patch;
    order : of the elements
    """

    def __init__(self, case: Case, depth: int, reach: float, order: int):
        begin = perf_counter()
        # without what models learn from, and without prepared contacts: patches are integrated where they are needed
        self._case = replace(case, response=None, database=case.meshes)
        self._depth, self._radius_m, self._order = depth, reach * case.radius_m, order
        self._refinement, self._surface = LocalRefinement(case.body, depth), SurfaceMap(case.body)
        self._contacts = contacts_of(case.body)
        self._made: dict[int, tuple[Simulation, sparse.csr_array]] = {}
        self._seconds = perf_counter() - begin

    def prepare(self, case: Case) -> None:
        """Make the meshes of the prepared contacts, or charge what that took for another setting."""
        missing = [int(c) for c in case.prepared_contacts if int(c) not in self._made]
        if not missing:
            case.charge("meshes", self._seconds)
        begin = perf_counter()
        for contact in missing:
            self.of(contact)
        self._seconds += perf_counter() - begin

    def of(self, contact: int) -> tuple[Simulation, sparse.csr_array]:
        """Return the simulation on the mesh of ``contact``, and its map; InputError for a bad contact."""
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


offline = Offline
