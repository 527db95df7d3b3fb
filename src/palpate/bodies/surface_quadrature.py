"""Quadrature and shape functions on surface triangles, exact over their part in a ball; the enclosed volume."""

import numpy as np
from scipy import sparse

from palpate.bodies.mesh import Mesh, corner_normals
from palpate.bodies.refinement import edge_midpoints, quadratic_gradients, shape_functions

EDGES = np.array([[0, 1], [0, 2], [1, 2]])
"""The edges of a triangle, in the order of the midpoints of its quadratic shape functions."""


def midpoints(mesh: Mesh, triangles: np.ndarray) -> np.ndarray:
    """Return the numbers (m, 3) of the midpoints of the EDGES of ``triangles`` (m, 3): those that refinement gives."""
    return edge_midpoints(mesh, triangles[:, EDGES])


def triangle_shapes(barycentric: np.ndarray, order: int) -> np.ndarray:
    """Return the shape functions (…, 3), or of order 2 (…, 6), at ``barycentric`` coordinates (…, 3) of triangles."""
    return barycentric if order == 1 else shape_functions(barycentric, EDGES)


def surface_interpolation(mesh: Mesh, triangles: np.ndarray, barycentric: np.ndarray, order: int) -> sparse.csr_array:
    """Return the map (k, n) to points with ``barycentric`` coordinates (k, 3) in ``triangles`` (k,) of ``mesh``.

    n counts its nodes, and for ``order`` 2 then its edges.
    """
    nodes, count = mesh.triangles[triangles], len(mesh.nodes)
    if order == 2:
        nodes, count = np.hstack([nodes, midpoints(mesh, nodes)]), count + len(mesh.edges)
    shapes = triangle_shapes(barycentric, order)
    rows = np.repeat(np.arange(len(nodes)), nodes.shape[1])
    return sparse.csr_array((shapes.ravel(), (rows, nodes.ravel())), shape=(len(nodes), count))


def near_ball(corners: np.ndarray, center: np.ndarray, radius: float) -> np.ndarray:
    """Return which triangles ``corners`` (m, 3, 3) [m] may meet a ball, (m,) bool."""
    middle = corners.mean(axis=1)
    reach = np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1) + radius
    return np.linalg.norm(middle - center, axis=1) < reach


def ball_points(
    corners: np.ndarray, center: np.ndarray, radius: float, degree: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the quadrature that integrates polynomials up to ``degree`` over the part of each triangle in a ball.

    corners : (m, 3, 3) [m]; center : (3,) [m]; radius : [m]
    Returns barycentric coordinates (m, k, 3), weights (m, k) [m²], which may be negative, and the squared distances
    from the centre over that of the ball (m, k).

    The ball cuts the plane of a triangle in a circle. Seen from its middle, the part of the triangle in it is the sum,
    with signs, of what each edge sweeps: a triangle where the edge runs inside the circle, sectors where it is outside.
    Gauss points on the edge and along the rays are exact; those on an arc, of at most 90°, are right to 1e-13.
    """
    normal = corner_normals(corners)
    doubled_area = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = normal / doubled_area
    plane_offset = ((center - corners[:, 0]) * normal).sum(axis=1, keepdims=True)
    circle_center = center - plane_offset * normal
    circle_radius_2 = np.clip(radius**2 - plane_offset**2, 0.0, None)
    rim, swept = _rim(corners - circle_center[:, None], normal, circle_radius_2, degree)

    ray_shares, weights = _gauss(degree + 1)
    points = (ray_shares[:, None] * rim[:, :, None, :]).reshape(len(corners), -1, 3)
    distance = (plane_offset**2 + (points**2).sum(axis=-1)) / radius**2
    next_corners, previous_corners = np.roll(corners, -1, axis=1), np.roll(corners, 1, axis=1)
    slopes = np.cross(normal[:, None], previous_corners - next_corners) / doubled_area[:, None]
    at_center = np.einsum("mai,mai->ma", slopes, circle_center[:, None] - next_corners)
    barycentric = points @ slopes.transpose(0, 2, 1) + at_center[:, None]
    return barycentric, (swept[..., None] * (ray_shares * weights)).reshape(len(corners), -1), distance


def _rim(corners: np.ndarray, normal: np.ndarray, squared: np.ndarray, degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Return points (m, k, 3) on the rim of each triangle's part in a circle, and the doubled area that each sweeps.

    corners : (m, 3, 3), seen from the circle's middle; normal : (m, 3); squared : (m, 1) square of its radius
    """
    edges = np.roll(corners, -1, axis=1) - corners
    length = (edges**2).sum(axis=2)
    foot = -(corners * edges).sum(axis=2) / length
    line_distance_2 = ((corners + foot[..., None] * edges) ** 2).sum(axis=2)
    half = np.sqrt(np.clip(squared - line_distance_2, 0.0, None) / length)
    shares = [np.zeros_like(half), *np.clip([foot - half, foot + half], 0.0, 1.0), np.ones_like(half)]
    ends = [corners + share[..., None] * edges for share in shares]
    upward = np.broadcast_to(normal[:, None], corners.shape)
    swept_parts = [
        _arc(ends[0], ends[1], upward, squared, degree),
        _chord(ends[1], ends[2], upward, degree),
        _arc(ends[2], ends[3], upward, squared, degree),
    ]
    rim, swept = (np.concatenate(each, axis=2) for each in zip(*swept_parts, strict=True))
    return rim.reshape(len(corners), -1, 3), swept.reshape(len(corners), -1)


def _chord(begin: np.ndarray, end: np.ndarray, upward: np.ndarray, degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Return points (m, 3, k, 3) on the segments from ``begin`` to ``end``, and the doubled area that each sweeps."""
    places, weights = _gauss(degree)
    area = (np.cross(begin, end) * upward).sum(axis=2)
    return begin[:, :, None] + places[:, None] * (end - begin)[:, :, None], area[..., None] * weights


def _arc(
    begin: np.ndarray, end: np.ndarray, upward: np.ndarray, squared: np.ndarray, degree: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return points (m, 3, k, 3) on the arcs between the rays to ``begin`` and ``end``, and their doubled areas."""
    places, weights = _gauss(2 * degree + 12)
    angle = np.arctan2((np.cross(begin, end) * upward).sum(axis=2), (begin * end).sum(axis=2))
    lengths = np.linalg.norm(begin, axis=2, keepdims=True)
    start = np.divide(begin, lengths, out=np.zeros_like(begin), where=lengths > 0.0) * np.sqrt(squared)[..., None]
    angles = (angle[..., None] * places)[..., None]
    points = np.cos(angles) * start[:, :, None] + np.sin(angles) * np.cross(upward, start)[:, :, None]
    return points, (angle * squared)[..., None] * weights


def _gauss(degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Return Gauss points (k,) and weights (k,) on 0 to 1 that integrate polynomials up to ``degree``."""
    points, weights = np.polynomial.legendre.leggauss(degree // 2 + 1)
    return (points + 1.0) / 2.0, weights / 2.0


def enclosed_volume(mesh: Mesh, x: np.ndarray) -> float:
    """Compute the volume [m³] within the surface of ``mesh`` whose nodes are at ``x`` (n, 3) [m].

    With as many rows more as the mesh has ``edges``, the faces are those of quadratic elements. The volume is
    ∮ x · n dA / 3, which for these is a polynomial of degree 4 on each triangle: nine points integrate it exactly.
    """
    corners = mesh.triangles
    if len(x) == len(mesh.nodes):
        return float(np.linalg.det(x[corners]).sum()) / 6.0
    places = x[np.hstack([corners, midpoints(mesh, corners)])]
    volume, gauss = 0.0, list(zip(*_gauss(4), strict=True))
    for u, by_u in gauss:
        for v, by_v in gauss:
            at = np.array([[1.0 - u - v * (1.0 - u), u, v * (1.0 - u)]])
            rates = np.array([[-1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]]) @ quadratic_gradients(at, EDGES)[0].T
            point, du, dv = (np.einsum("a,mai->mi", each, places) for each in (*triangle_shapes(at, 2), *rates))
            volume += by_u * by_v * (1.0 - u) * float(np.vdot(point, np.cross(du, dv)))
    return volume / 3.0
