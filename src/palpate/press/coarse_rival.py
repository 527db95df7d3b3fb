"""A simple model to compare with on the page: linear elements on the coarse mesh under small strains, as in a game.

It answers presses anywhere from the compliance of the coarse surface, in bytes that the page holds.
"""

import json
from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np

from palpate.bodies.body import Body
from palpate.bodies.mesh import area_normals
from palpate.press.portable.runtimes.palpate_model import PortableAnswer
from palpate.solvers.equilibrium import Equilibrium

MOST_SURFACE_NODES = 420
"""Free coarse surface nodes beyond which the bytes would be more than 6 MB; such a body goes without."""
_ARRAYS = {"nodes": "<f4", "triangles": "<u4", "parents": "<u4", "weights": "<f4", "compliance": "<f4"}


class CoarseAnswer:
    """The compliance of the m free coarse surface nodes, and the interpolation from them to the n fine surface nodes.

    info : name of the body, radius_m, and ``shapes`` of the arrays
    nodes (n, 3) [m], triangles (t, 3) : of the fine surface; compliance (3 m, 3 m) [m/N]
    parents, weights (n, 3) : the free coarse nodes that a fine one is interpolated from
    """

    def __init__(self, info: Mapping, **arrays: np.ndarray):
        self.info, self.arrays = dict(info), arrays
        self.nodes, self.triangles = arrays["nodes"].astype(float), arrays["triangles"]

    @cached_property
    def _normals(self) -> np.ndarray:
        """Normals (n, 3) at the nodes, as long as the areas of the triangles around them are large."""
        areas, normals = area_normals(self.nodes, self.triangles), np.zeros_like(self.nodes)
        for corner in range(3):
            np.add.at(normals, self.triangles[:, corner], areas)
        return normals

    def shares(self, triangle: int, weights: Sequence[float]) -> np.ndarray:
        """Return the part (m,) of a force on the disc at a place of ``triangle`` that acts on each free coarse node."""
        corners = self.triangles[triangle]
        place, normal = np.asarray(weights) @ self.nodes[corners], np.asarray(weights) @ self._normals[corners]
        pressure = 1.0 - ((self.nodes - place) ** 2).sum(axis=1) / self.info["radius_m"] ** 2
        under_disc = (pressure > 0.0) & (self._normals @ normal > 0.0)
        fine = np.where(under_disc, pressure * np.linalg.norm(self._normals, axis=1), 0.0)
        if not fine.any():
            fine[corners] = weights
        coarse_shares = np.zeros(len(self.arrays["compliance"]) // 3)
        np.add.at(coarse_shares, self.arrays["parents"], self.arrays["weights"] * (fine / fine.sum())[:, None])
        return coarse_shares

    def respond(self, presses: Sequence[Mapping]) -> PortableAnswer:
        """Answer ``presses``, each with triangle, weights, and force [N] or moved [m]; without an error or a doubt."""
        shares = np.array([self.shares(press["triangle"], press["weights"]) for press in presses])
        count = shares.shape[1]
        compliance = self.arrays["compliance"].reshape(count, 3, count, 3)
        # (k, m, 3, 3) [m/N], how free coarse nodes move by a unit force along x, y and z on each disc
        moved_by = np.stack([np.einsum("iajb,j->iab", compliance, share, optimize=True) for share in shares])
        disc_compliance = np.einsum("im,kmab->iakb", shares, moved_by).reshape(3 * len(shares), -1)
        prescribed = np.array([press["moved"] if "moved" in press else press["force"] for press in presses])
        forces = press_forces(disc_compliance, prescribed, np.array(["moved" in press for press in presses]))
        coarse = np.einsum("kmab,kb->ma", moved_by, forces)
        moved = np.einsum("nc,nca->na", self.arrays["weights"], coarse[self.arrays["parents"]])
        return PortableAnswer(moved, forces, float("nan"), "", [])


def press_forces(compliance: np.ndarray, given: np.ndarray, pushed: np.ndarray) -> np.ndarray:
    """Return the forces (k, 3) [N] of k presses of a linear body, some by a force and some to a displacement.

    compliance : (3 k, 3 k) [m/N], from the forces of all presses to the mean displacements of their discs
    given : (k, 3), force [N] or displacement [m]; pushed : (k,) bool, which of them are displacements
    """
    unknown, forces = np.repeat(pushed, 3), np.where(pushed[:, None], 0.0, given).ravel()
    if unknown.any():
        missing_m = (given.ravel() - compliance @ forces)[unknown]
        forces[unknown] = np.linalg.solve(compliance[np.ix_(unknown, unknown)], missing_m)
    return forces.reshape(-1, 3)


def coarse_answer(body: Body, radius_m: float) -> CoarseAnswer | None:
    """Compute the answer of the coarse mesh of ``body`` to discs of ``radius_m`` [m]; None if it is too large."""
    surface, fine = np.setdiff1d(body.coarse.surface, body.anchors[0]), body.fine
    if len(surface) > MOST_SURFACE_NODES:
        return None
    compliance = _compliance(body, surface)
    interpolation = body.prolongation[fine.surface][:, surface].tolil()
    parents, weights = np.zeros((len(fine.surface), 3), int), np.zeros((len(fine.surface), 3))
    for node, (columns, shares) in enumerate(zip(interpolation.rows, interpolation.data, strict=True)):
        parents[node, : len(columns)], weights[node, : len(columns)] = columns, shares
    arrays = {"nodes": fine.nodes[fine.surface], "triangles": np.searchsorted(fine.surface, fine.triangles)}
    arrays |= {"parents": parents, "weights": weights, "compliance": compliance}
    stored = {name: arrays[name].astype(kind) for name, kind in _ARRAYS.items()}
    shapes = {name: list(array.shape) for name, array in stored.items()}
    return CoarseAnswer({"body": body.name, "radius_m": radius_m, "shapes": shapes}, **stored)


def _compliance(body: Body, nodes: np.ndarray) -> np.ndarray:
    """Return the compliance (3 m, 3 m) [m/N] of coarse ``nodes`` (m,), by linear elements at rest."""
    count, free = len(body.coarse.nodes), np.ones(len(body.coarse.nodes), bool)
    free[body.anchors[0]] = False
    multiply, _ = Equilibrium(body, 0).linearise(body.coarse.nodes)
    unit_displacements = np.eye(3 * count).reshape(count, 3, -1)
    stiffness = multiply(unit_displacements).reshape(3 * count, -1)
    unknowns = np.flatnonzero(np.repeat(free, 3))
    rows = np.searchsorted(unknowns, (3 * nodes[:, None] + np.arange(3)).ravel())
    compliance = np.linalg.solve(stiffness[np.ix_(unknowns, unknowns)], np.eye(len(unknowns))[:, rows])[rows]
    return (compliance + compliance.T) / 2


def packed(answer: CoarseAnswer) -> bytes:
    """Return ``answer`` as bytes: a line of JSON, then its arrays one after the other."""
    head = json.dumps(answer.info).encode()
    head += b" " * (-(len(head) + 1) % 4) + b"\n"
    return head + b"".join(answer.arrays[name].tobytes() for name in _ARRAYS)
