"""Loads on a patch of a surface: its place, their course over time, and a pressure over a disc, integrated exactly."""

from dataclasses import dataclass

import numpy as np

from palpate.bodies.body import Body
from palpate.bodies.mesh import Mesh, corner_normals
from palpate.bodies.surface_quadrature import ball_points, midpoints, near_ball, triangle_shapes
from palpate.effects.settings import Hook, Load
from palpate.errors import InputError

FACING = 1e-6
"""Cosine of the angle to the patch's normal above which a triangle faces it; not 0, where rounding would decide."""


@dataclass(frozen=True, eq=False)
class Patch:
    """A disc on a body's surface: ``center_m`` (3,) [m], its outward unit ``normal`` (3,), ``radius_m`` [m]."""

    center_m: np.ndarray
    normal: np.ndarray
    radius_m: float


def patch_at(body: Body, contact: int, radius_m: float) -> Patch:
    """Return the patch of ``radius_m`` [m] around coarse node ``contact``, with the fine surface's normal there."""
    return Patch(body.fine.nodes[contact], body.fine.normals[contact], float(radius_m))


def nodal_load(body: Body, level: int, contact: int, force: np.ndarray, radius_m: float, order: int = 1) -> np.ndarray:
    """Compute nodal forces (n, 3) [N] on ``level`` of a total ``force`` (3,) [N] around coarse node ``contact``.

    With ``radius_m`` 0 the force acts on the node alone (paper 1), otherwise as ``patch_shares`` distributes it. n is
    the number of nodes of ``level``, or for order 2 of the level after it. On levels of the same shape the load is the
    same: it does the same work on a displacement that both can have.
    """
    return spread(body.levels[level], patch_at(body, contact, radius_m), force, order)


def spread(mesh: Mesh, patch: Patch, force: np.ndarray, order: int = 1) -> np.ndarray:
    """Spread a total ``force`` (3,) [N] on ``patch`` over nodes, and for order 2 edges, of ``mesh``: (n, 3) [N]."""
    nodes, shares = patch_shares(mesh, patch, order)
    load = np.zeros((len(mesh.nodes) + (len(mesh.edges) if order == 2 else 0), 3))
    load[nodes] = np.outer(shares, force)
    return load


def patch_shares(mesh: Mesh, patch: Patch, order: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Return the nodes (k,) that a force on ``patch`` acts on, and the fraction (k,) of it on each; they sum to 1.

    The pressure is proportional to 1 − (distance/radius)² on triangles whose normal is within 90° of the patch's, and
    is integrated with the shape functions of ``mesh``: linear ones, or for order 2 quadratic ones, whose nodes are the
    mesh's and then the midpoints of its ``edges``, and whose fractions may be negative. With a radius of 0, or without
    such a triangle, the force is on the surface point nearest to the centre.

    Trap: area weights in place of the integral spoil quadratic elements: by up to 63 % of the peak at the patch.
    """
    corners = mesh.triangles[_touched(mesh, patch)] if patch.radius_m > 0.0 else mesh.triangles[:0]
    integrals = _integrals(mesh.nodes[corners], patch, order)
    if not integrals.sum() > 0.0:
        distance = np.linalg.norm(mesh.nodes[mesh.surface] - patch.center_m, axis=1)
        if distance.min() <= AT_NODE * mesh.size:
            return mesh.surface[[np.argmin(distance)]], np.ones(1)
        nearest, weights, _ = surface_point(mesh, patch.center_m)
        corners, integrals = nearest[None], triangle_shapes(weights[None], order)
    if order == 2:
        corners = np.hstack([corners, midpoints(mesh, corners)])
    nodes, columns = np.unique(corners, return_inverse=True)
    shares = np.bincount(columns.ravel(), integrals.ravel())
    nonzero = shares != 0.0
    return nodes[nonzero], shares[nonzero] / shares.sum()


def _touched(mesh: Mesh, patch: Patch) -> np.ndarray:
    """List the triangles that face the patch and may meet its ball."""
    corners = mesh.nodes[mesh.triangles]
    areas = corner_normals(corners)
    facing = areas @ patch.normal > FACING * np.linalg.norm(areas, axis=1)
    return np.flatnonzero(facing & near_ball(corners, patch.center_m, patch.radius_m))


def _integrals(corners: np.ndarray, patch: Patch, order: int) -> np.ndarray:
    """Integrate the pressure times each shape function over triangles ``corners`` (m, 3, 3) [m]: (m, 3 or 6)."""
    if not len(corners):
        return np.zeros((0, 3 * order))
    barycentric, weights, distance = ball_points(corners, patch.center_m, patch.radius_m, 2 + order)
    return np.einsum("mk,mka->ma", weights * (1.0 - distance), triangle_shapes(barycentric, order))


SAME_S = 1e-9
"""Difference [s] up to which two times are the same, as those of steps are rounded."""


def course(since: float, rise_s: float, hold_s: float, fall_s: float) -> float:
    """Return the factor of a load ``since`` [s] after its start: a rise from 0 to 1, a constant time, a fall to 0."""
    return ramp(since, rise_s) - ramp(since - rise_s - hold_s, fall_s)


def ramp(since: float, lasts_s: float) -> float:
    """Return 3q² − 2q³ with q = ``since`` / ``lasts_s`` from 0 to 1: a smooth rise, as a sudden one excites waves."""
    if since < 0.0:
        return 0.0
    q = min(since / lasts_s, 1.0) if lasts_s > 0.0 else 1.0
    return q * q * (3.0 - 2.0 * q)


OFF = 0.1
"""Largest distance of a load from the body's surface, over the body's size."""
AT_NODE = 1e-6
"""Distance, over the size of a facet or of the body, up to which a point is at an edge or a node."""


def load_point(mesh: Mesh, held: np.ndarray, place: str, load: Load | Hook) -> tuple[np.ndarray, np.ndarray]:
    """Return the surface point nearest to ``at_m`` of a load: its facet (3,) and barycentric coordinates (3,).

    held : nodes that do not move; place : of the load in the settings, for messages
    Raises InputError for a load off the surface, of a radius beyond the body's size, or on held nodes.
    """
    if load.radius_m > mesh.size:
        raise InputError(
            f"{place}.radius_m is {load.radius_m:g} m, and the whole body is "
            f"{mesh.size:.3g} m long; give the radius of what presses or grasps it, in metres."
        )
    corners, weights, away = surface_point(mesh, np.array(load.at_m, dtype=float))
    point = np.round(weights @ mesh.nodes[corners], 4).tolist()
    if not away <= OFF * mesh.size:
        raise InputError(
            f"{place}.at_m is {away:.3g} m from the nearest point of its surface, {point}; "
            "give a point on the surface, in metres."
        )
    if np.isin(corners[weights > 0.0], held).all():
        raise InputError(f"{place}.at_m is nearest to {point}, which is held; go farther from the anchors.")
    return corners, weights


def surface_point(mesh: Mesh, point: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Return the surface point nearest to a point (3,) [m]: facet (3,), barycentric coordinates (3,), distance [m].

    At a node, or on an edge, the coordinates of other nodes are exactly zero.
    """
    (corners,), (weights,), (away,) = nearest_on_surface(mesh, point[None])
    weights = np.where(weights > AT_NODE, weights, 0.0)
    return corners, weights / weights.sum(), float(away)


def containing(triangles: np.ndarray, corners: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return which of ``triangles`` (t, 3) contain a point of ``surface_point``: for a node all around it."""
    few = corners[weights > 0.0]
    return np.isin(triangles, few).sum(axis=1) == len(few)


def nearest_on_surface(mesh: Mesh, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Find the points of the surface at rest nearest to ``points`` (p, 3) [m].

    Returns the corners (p, 3) of their triangles, barycentric coordinates (p, 3), and distances (p,) [m].
    """
    from scipy.spatial import cKDTree

    corners = mesh.nodes[mesh.triangles]
    middles = corners.mean(axis=1)
    # the nearest corner bounds the distance, and a triangle's middle is farther by its own reach at most
    reach = float(np.linalg.norm(corners - middles[:, None], axis=2).max())
    bound = cKDTree(mesh.nodes[mesh.surface]).query(points)[0] + reach
    near_points = cKDTree(middles).query_ball_point(points, bound * (1.0 + 1e-9), return_sorted=True)
    nodes, weights, away = [], [], []
    for point, candidates in zip(points, near_points, strict=True):
        shares = _nearest_shares(corners[candidates], point)
        distance = np.linalg.norm(np.einsum("ta,tai->ti", shares, corners[candidates]) - point, axis=1)
        nearest = int(distance.argmin())
        nodes.append(mesh.triangles[candidates[nearest]])
        weights.append(shares[nearest])
        away.append(distance[nearest])
    return np.array(nodes), np.array(weights), np.array(away)


def _nearest_shares(corners: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Return barycentric coordinates (t, 3) of the points of triangles (t, 3, 3) [m] nearest to a point (3,) [m]."""
    sides = np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2)
    coordinates = np.einsum("tab,tb->ta", np.linalg.pinv(sides), point - corners[:, 0])
    shares = np.column_stack([1.0 - coordinates.sum(axis=1), coordinates])
    # a projection inside of the triangle is the nearest point; else that is on one of the edges
    nearest, least = shares, np.where(shares.min(axis=1) >= 0.0, -1.0, np.inf)
    for a, b in ((0, 1), (1, 2), (2, 0)):
        edge = corners[:, b] - corners[:, a]
        along = np.einsum("ti,ti->t", point - corners[:, a], edge) / np.einsum("ti,ti->t", edge, edge)
        along = np.clip(along, 0.0, 1.0)
        away = np.linalg.norm(corners[:, a] + along[:, None] * edge - point, axis=1)
        on_edge = np.zeros_like(shares)
        on_edge[:, a], on_edge[:, b] = 1.0 - along, along
        nearest = np.where((away < least)[:, None], on_edge, nearest)
        least = np.minimum(least, away)
    return nearest
