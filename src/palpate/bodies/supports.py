"""What holds a body: held nodes (anchors), chosen by rules, and an elastic bed under a part of the surface."""

import warnings
from dataclasses import dataclass, replace

import numpy as np

from palpate.bodies.mesh import Mesh, Sheet, area_normals, components, within
from palpate.bodies.settings import Anchors, Plane
from palpate.bodies.settings import Bed as BedSettings
from palpate.errors import InputError
from palpate.setting_types import Axis

FACING = 0.5
"""Cosine of the largest angle, 60°, between ``facing`` and the normal of a triangle with springs."""
TOUCHING = 1e-6
"""Share of the body's height up to which faces that overlap by rounding touch."""


@dataclass(frozen=True, eq=False)
class Bed:
    """Springs under the surface in a sphere, that resist displacement in each direction.

    center_m : (3,) [m]; radius_m : [m]
    stiffness_n_m3 : traction per displacement at the centre [N/m³], which fades to zero at the sphere
    facing : (3,) unit vector; only triangles whose outward normal is within 60° of it have springs, unless more of the
        body is in that direction, as within a hollow or under a lobe; None for all
    """

    center_m: np.ndarray
    radius_m: float
    stiffness_n_m3: float
    facing: np.ndarray | None = None

    def moved(self, shift: np.ndarray) -> "Bed":
        """Return the bed of a body that is moved by ``shift`` (3,) [m]."""
        return replace(self, center_m=self.center_m + shift)

    def faces(self, nodes: np.ndarray, triangles: np.ndarray) -> np.ndarray:
        """Return which ``triangles`` (m, 3) on ``nodes`` (n, 3) [m] have springs by ``facing``, (m,) bool."""
        if self.facing is None:
            return np.ones(len(triangles), dtype=bool)
        corners, normals = nodes[triangles], area_normals(nodes, triangles)
        heights, in_plane = corners @ self.facing, corners @ np.linalg.svd(self.facing[None])[2][1:].T
        faces = normals @ self.facing >= FACING * np.linalg.norm(normals, axis=1)
        facing, facing_back = np.flatnonzero(faces), np.flatnonzero(normals @ self.facing < 0)
        place, back_above, weights = within(in_plane[facing].mean(axis=1), in_plane[facing_back])
        height_above = (weights * heights[facing_back[back_above]]).sum(axis=1) - heights[facing[place]].mean(axis=1)
        hidden = (weights.min(axis=1) >= 0) & (height_above > -TOUCHING * np.ptp(heights))
        faces[facing[place[hidden]]] = False
        return faces


def read_bed(body: str, rule: BedSettings, mesh: Mesh) -> Bed:
    """Make the bed of a body's settings; InputError unless it faces somewhere and meets the body."""
    sphere, stiffness = rule.sphere, float(rule.stiffness_n_m3)
    facing = None if rule.facing is None else np.array(rule.facing, dtype=float)
    if facing is not None:
        if not np.any(facing):
            raise InputError(f"body {body}: bed.facing is [0, 0, 0]; give the direction that the bed's side faces.")
        facing = facing / np.linalg.norm(facing)
    bed = Bed(np.array(sphere.center_m, dtype=float), float(sphere.radius_m), stiffness, facing)
    inside = inner_nodes(mesh, bed)
    if len(inside) < 3:
        raise InputError(
            f"body {body}: bed.sphere holds {len(inside)} nodes of the coarse surface; move or enlarge it so that at "
            "least 3 lie in it, or change facing."
        )
    if len(inside) == len(mesh.surface):
        raise InputError(
            f"body {body}: bed.sphere holds the whole surface, so nothing can be pressed; make it smaller."
        )
    return bed


def inner_nodes(mesh: Mesh, bed: Bed) -> np.ndarray:
    """Return the surface nodes in the sphere of ``bed``, and of the triangles that face as it asks, increasing."""
    nodes = np.unique(mesh.triangles[bed.faces(mesh.nodes, mesh.triangles)])
    distance = np.linalg.norm(mesh.nodes[nodes] - bed.center_m, axis=1)
    return nodes[distance < bed.radius_m]


# fraction of the longest side that is held where no rule is given
HELD = 0.1


def choose_anchors(body: str, rule: Anchors | None, mesh: Mesh, bed: Bed | None = None) -> np.ndarray:
    """Choose the coarse nodes that a rule holds, in increasing order; without a rule, on a bed or free, none.

    Raises InputError if the rule holds no node, or leaves a piece of the body free to turn. Only a sheet may turn: it
    usually hangs by an edge or a corner, and is used only in scenes, where bodies have mass.
    """
    if rule is None:
        none_held = np.empty(0, dtype=np.int64)
        if bed is not None:
            _check_pieces(body, none_held, mesh, bed)
        return none_held
    held, kind = _held(body, rule, mesh)
    none_held = np.setdiff1d(mesh.surface, held)
    if not len(none_held):
        raise InputError(
            f"body {body}: anchors.{kind} holds every node of the surface, so nothing can be pressed; hold fewer: "
            f"the body is {' × '.join(f'{side:.3g}' for side in np.ptp(mesh.nodes, axis=0))} m."
        )
    if not isinstance(mesh, Sheet):
        _check_pieces(body, held, mesh, bed)
    return held


def default_anchors(body: str, mesh: Mesh) -> Anchors:
    """Choose to hold the low end of the longest axis, a tenth of its length, and warn of that."""
    extent = np.ptp(mesh.nodes, axis=0)
    axes: list[Axis] = ["x", "y", "z"]
    axis = int(np.argmax(extent))
    depth = float(f"{HELD * extent[axis]:.3g}")
    # the end may be narrow: deeper, until it holds the body
    while np.sum(mesh.nodes[:, axis] - mesh.nodes[:, axis].min() <= depth) < 4:
        depth *= 1.5
    warnings.warn(
        f"anchors is not given; the nodes within {depth:.3g} m of its lowest {axes[axis]}, one end of its longest "
        "side, are held; give anchors where the organ is attached.",
        stacklevel=3,
    )
    return Anchors(plane=Plane(axis=axes[axis], side="min", depth_m=depth))


def _held(body: str, rule: Anchors, mesh: Mesh) -> tuple[np.ndarray, str]:
    """Return the nodes that one rule holds, increasing, and the rule's name."""
    if rule.several is not None:
        kind, held = "several", np.concatenate([_held(body, single, mesh)[0] for single in rule.several])
    elif rule.plane is not None:
        along = mesh.nodes[:, "xyz".index(rule.plane.axis)] * (1 if rule.plane.side == "min" else -1)
        kind, held = "plane", np.flatnonzero(along - along.min() <= rule.plane.depth_m)
    elif rule.sphere is not None:
        distance = np.linalg.norm(mesh.nodes - np.asarray(rule.sphere.center_m, dtype=float), axis=1)
        kind, held = "sphere", np.flatnonzero(distance <= rule.sphere.radius_m)
    else:
        kind, held = "nodes", np.array(rule.nodes, dtype=np.int64)
        if (missing := held[held >= len(mesh.nodes)]).size:
            raise InputError(
                f"body {body}: anchors.nodes names {missing[0]}, which does not exist; "
                f"its coarse nodes are counted from 0, and go up to {len(mesh.nodes) - 1}."
            )
    if not len(held):
        raise InputError(f"body {body}: anchors.{kind} holds no node; move or enlarge it so that it meets the body.")
    return np.unique(held), kind


def can_hold(points: np.ndarray, size: float) -> bool:
    """Return whether a body of ``size`` [m] that is held at ``points`` (n, 3) [m] cannot turn: three are on no line."""
    return len(points) > 2 and bool(np.linalg.svd(points - points.mean(axis=0), compute_uv=False)[1] > 1e-6 * size)


def _check_pieces(body: str, held: np.ndarray, mesh: Mesh, bed: Bed | None) -> None:
    """Raise InputError unless each piece of the body is held such that it cannot turn."""
    if bed is not None:
        held = np.union1d(held, inner_nodes(mesh, bed))
    piece = components(mesh.edges, len(mesh.nodes))
    count = piece.max() + 1
    for number in range(count):
        points = mesh.nodes[held[piece[held] == number]]
        part = f"the piece of node {np.argmax(piece == number)}, one of {count}," if count > 1 else "the body"
        if not len(points):
            raise InputError(
                f"body {body}: anchors hold no node of {part.rstrip(',')}; hold some there or remove the piece."
            )
        if not can_hold(points, mesh.size):
            raise InputError(
                f"body {body}: anchors let {part} turn about the held nodes; hold three or more that are not on a line."
            )
