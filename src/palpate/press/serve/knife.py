"""Elements that are cut with a knife while they are pressed: each request names all cuts of the body at rest.

A level with few elements is cut with virtual nodes, and its stiffness factorised anew. Presses are distributed over the
drawn surface, with its lips, so that a disc beside a cut acts on the tissue of its side alone.
"""

import json
from collections.abc import Sequence
from dataclasses import replace
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
from scipy import sparse

from palpate.benchmark.model import Case
from palpate.bodies.body import Body
from palpate.bodies.cutting.cut import Cut, make_cut
from palpate.bodies.cutting.settings import CutSettings
from palpate.bodies.cutting.ways import VIRTUAL_NODES, Parted, part, whole
from palpate.bodies.mesh import Sheet, components, edge_lengths
from palpate.bodies.surface_quadrature import near_ball
from palpate.effects.patch_load import Patch, patch_shares
from palpate.errors import InputError
from palpate.models.fem_statics import to_surface
from palpate.press.coarse_rival import press_forces
from palpate.press.serve.drawn import Drawn, drawn
from palpate.press.serve.pressed_model import Asked, Found
from palpate.solvers.equilibrium import Equilibrium
from palpate.solvers.pushed_discs import OVERLAP, push

MOST_NODES = 1500
"""Most nodes of a level that is cut and factorised within a tenth of a second; the finest such level answers."""
MOST_CUTS, MOST_POINTS = 4, 12
"""Cuts of a body, and points of the path of each."""
FULLY = 1e-9
"""What the weights of held nodes may lack where a point follows them alone."""
TOLERANCE = 1e-3
"""Relative residual of an answer, far below the error of a level of so few nodes."""


def read_cuts(body: bytes) -> list[CutSettings]:
    """Read the cuts of a request ``{"cuts": [{"path_m": …, "depth_m": …}, …], …}``; InputError for another form."""
    try:
        request = json.loads(body)
        cuts = request.get("cuts", [])
        if not isinstance(cuts, list):
            raise TypeError
        wanted_cuts = [_read(each) for each in cuts]
    except (ValueError, TypeError, AttributeError, OverflowError, RecursionError):
        raise InputError('post {"cuts": [...]}, each with path_m, points of three numbers, and depth_m.') from None
    if len(wanted_cuts) > MOST_CUTS:
        raise InputError(f"there are {len(wanted_cuts)} cuts; make the body whole after {MOST_CUTS} of them.")
    return wanted_cuts


def _read(sent: Any) -> CutSettings:
    path, depth = np.array(sent["path_m"], dtype=float), float(sent["depth_m"])
    if set(sent) != {"path_m", "depth_m"} or path.ndim != 2 or path.shape[1] != 3 or len(path) > MOST_POINTS:
        raise TypeError
    if not (np.abs(path).max() < 1e3 and 0.0 <= depth < 1e3):  # comparisons that NaN fails
        raise ValueError
    return CutSettings(path_m=path.tolist(), depth_m=depth)


def cut_level(body: Body) -> tuple[int, float]:
    """Return the finest level that is cut soon, and the median edge [m] of its elements; InputError without any."""
    counts = [len(mesh.nodes) for mesh in body.levels]
    if counts[0] > MOST_NODES:
        raise InputError(f"{body.name}: {counts[0]} nodes cannot be cut at once; give it a coarser mesh.")
    level = sum(count <= MOST_NODES for count in counts) - 1
    mesh = body.levels[level]
    return level, float(np.median(edge_lengths(mesh.nodes, mesh.edges)))


class Followed(NamedTuple):
    """A cut body: the surface to draw, which of its nodes are held, (n,) bool, and the times taken.

    ready, seen : milliseconds until presses could be answered, and of finding the surface after that
    """

    surface: Drawn
    held: np.ndarray
    ready: float
    seen: float


class KnifeModel:
    """Linear elements of a level that follow cuts; with ``linear`` strains are small, else the law is the body's.

    Raises InputError for a body whose coarsest level is too large to be cut at once.
    """

    def __init__(self, case: Case, linear: bool):
        self._body, self._radius_m, self._linear = case.body, case.radius_m, linear
        self._level, self._edge_m = cut_level(case.body)
        self._mesh = case.body.levels[self._level]
        self._skin, self._triangles = case.database.nodes_fine_surface, case.database.triangles
        self._rows = to_surface(case.body, self._level)
        self._cuts: list[CutSettings] | None = None
        self.follow([])

    def follow(self, cuts: list[CutSettings]) -> Followed:
        """Cut the body at rest by ``cuts``, of ``read_cuts``, and no others; return the cut body.

        Nothing is computed if these are its cuts already. Raises InputError for a cut that is outside the body or
        severs nothing, and keeps the cuts from before.
        """
        if cuts != self._cuts:
            begin = perf_counter()
            made = [make_cut(f"cut {number}", each, self._mesh) for number, each in enumerate(cuts, 1)]
            parted = part(self._body, self._level, made, VIRTUAL_NODES) if made else whole(self._body, self._level, 0)
            held = np.isin(np.arange(len(parted.origin)), parted.body.anchors[0])
            self._refuse_idle(parted, held, made)
            loose = parted.loose(held)
            body = replace(parted.body, anchors=[np.flatnonzero(held | loose)])
            equilibrium, ready_s = Equilibrium(body, 0), perf_counter()
            surface = drawn(parted, made, self._skin, self._triangles, self._rows)
            self._surface, self._sheet = surface, Sheet(surface.nodes, surface.triangles, 0.0)
            self._fixed, self._loose, self._equilibrium = held | loose, loose, equilibrium
            is_held = surface.rows @ held.astype(float) > 1.0 - FULLY
            times = 1e3 * (ready_s - begin), 1e3 * (perf_counter() - ready_s)
            self._placed: dict[tuple[int, bytes], np.ndarray] = {}
            self._followed, self._cuts = Followed(surface, is_held, *times), cuts
        return self._followed

    def _refuse_idle(self, parted: Parted, held: np.ndarray, cuts: Sequence[Cut]) -> None:
        """Raise InputError if the last cut doubles no node, or only nodes that are held."""
        if not cuts:
            return
        earlier, whole_nodes = cuts[:-1], parted.whole.nodes
        nodes_before = part(self._body, self._level, earlier, VIRTUAL_NODES).origin if earlier else whole_nodes
        if len(parted.origin) <= len(nodes_before):
            edge_mm = 1e3 * self._edge_m
            raise InputError(f"this cut severs nothing, as elements are {edge_mm:.0f} mm long; cut longer or deeper.")
        copied = np.bincount(parted.origin)[parted.origin] > 1
        if held[copied & parted.solid].all():
            raise InputError("the body is held there, and a cut opens nothing; cut another place.")

    def respond(self, presses: list[Asked]) -> Found:
        """Answer presses on triangles of the surface; errors as in ``PressedModel``."""
        begin = perf_counter()
        placed_before, self._placed = self._placed, {}
        for each in presses:  # a finger that presses deeper stays at its place
            key = each.triangle, each.weights.tobytes()
            self._placed[key] = placed_before[key] if key in placed_before else self._weights(each)
        weights = sparse.csr_array(np.array([self._placed[each.triangle, each.weights.tobytes()] for each in presses]))
        gram = (weights @ weights.T).toarray()
        if np.linalg.cond(gram) > 1.0 / OVERLAP:
            raise InputError("two fingers press one place; let one of them go.")
        moved, forces = (self._linearly if self._linear else self._converged)(weights, presses)
        return Found(self._surface.rows @ moved, forces, None, "", 1e3 * (perf_counter() - begin))

    def _weights(self, request: Asked) -> np.ndarray:
        """Return the parts (n_parted,) of a press that act on the nodes of the cut level; 0 for held nodes."""
        sheet, corners = self._sheet, self._sheet.triangles[request.triangle]
        place, normal = request.weights @ sheet.nodes[corners], request.weights @ sheet.normals[corners]
        if not (length := float(np.linalg.norm(normal))) > 0.0:
            raise InputError("there is no skin at this place; press beside it.")
        nearby = np.flatnonzero(near_ball(sheet.nodes[sheet.triangles], place, self._radius_m))
        nearby = np.union1d(nearby, request.triangle)
        # a disc beside a cut does not reach over it
        piece = components(sheet.triangles[nearby][:, [0, 1, 1, 2]].reshape(-1, 2), len(sheet.nodes))
        connected = sheet.triangles[nearby[piece[sheet.triangles[nearby, 0]] == piece[corners[0]]]]
        nodes, shares = patch_shares(Sheet(sheet.nodes, connected, 0.0), Patch(place, normal / length, self._radius_m))
        weights = shares @ self._surface.rows[nodes]
        if weights @ self._loose > 0.5:
            raise InputError("this piece is cut free and hangs from nothing; make the body whole.")
        weights[self._fixed] = 0.0
        if not weights.any():
            raise InputError("the body is held there; press another place.")
        return weights

    def _linearly(self, weights: sparse.csr_array, presses: list[Asked]) -> tuple[np.ndarray, np.ndarray]:
        """Return displacements (n_parted, 3) [m] and forces (k, 3) [N] of k presses under small strains."""
        count = len(presses)
        unit_loads = np.einsum("kn,ab->nakb", weights.toarray(), np.eye(3)).reshape(-1, 3, 3 * count)
        moved = self._equilibrium.at_rest()(unit_loads)
        prescribed = np.array([each.moved if each.force is None else each.force for each in presses])
        compliance = (weights @ moved.reshape(len(moved), -1)).reshape(3 * count, 3 * count)
        forces = press_forces(compliance, prescribed, np.array([each.force is None for each in presses]))
        return moved @ forces.ravel(), forces

    def _converged(self, weights: sparse.csr_array, presses: list[Asked]) -> tuple[np.ndarray, np.ndarray]:
        """Return displacements and forces as ``_linearly`` does, with the body's law."""
        is_pushed = np.array([each.force is None for each in presses])
        forces = np.array([np.zeros(3) if each.force is None else each.force for each in presses])
        load, rest = weights.T @ forces, self._equilibrium.mesh.nodes
        if not is_pushed.any():
            return self._equilibrium.solve(load, TOLERANCE).x - rest, forces
        displacements = np.array([each.moved for each in presses if each.force is None])
        solution, forces[is_pushed] = push(self._equilibrium, load, weights[is_pushed], displacements, TOLERANCE)
        return solution.x - rest, forces
