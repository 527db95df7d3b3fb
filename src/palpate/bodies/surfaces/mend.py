"""Mending of a triangulated surface as it is found: repeated triangles, mixed winding, holes."""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from palpate.bodies.mesh import area_normals, components, triangle_edges
from palpate.bodies.mesh_file import in_words
from palpate.bodies.surfaces.tetrahedralize import label_shells
from palpate.bodies.surfaces.triangles import arrays, drop_unused, polydata, signed_volumes, weld
from palpate.errors import InputError

# a hole whose corners are this close to a plane, relative to its width, is flat
FLAT_THICKNESS = 0.03


class Hole(NamedTuple):
    """Open edges that hang together: their number, the width of the hole [m], its centre (3,) [m], if it is flat."""

    edges: int
    width_m: float
    centre_m: np.ndarray
    flat: bool


def find_holes(points: np.ndarray, triangles: np.ndarray) -> list[Hole]:
    """Find the holes of a surface, (n, 3) [m] and (m, 3)."""
    edges, count = triangle_edges(triangles)
    open_edges = edges[count == 1]
    if not len(open_edges):
        return []
    piece = components(open_edges, len(points))[open_edges[:, 0]]
    holes = []
    for number in np.unique(piece):
        rim = open_edges[piece == number]
        corners = points[np.unique(rim)]
        width = float(np.ptp(corners, axis=0).max())
        centre = corners.mean(axis=0)
        thickness = np.linalg.svd(corners - centre, compute_uv=False)[-1] / np.sqrt(len(corners))
        holes.append(Hole(len(rim), width, centre, bool(thickness <= FLAT_THICKNESS * width)))
    return holes


# points closer than this fraction of the size are merged where that closes gaps
GAP = 1e-4
# a hole up to this fraction of the size across is closed; a flat one, where the body was cut, up to the second
SMALL_HOLE, FLAT_HOLE = 0.12, 0.35


@dataclass
class Mended:
    """A surface and what was done to it.

    points, triangles : (n, 3) [m] and (m, 3), wound outward, inward around a hollow
    notes : what was mended, each a few words with numbers
    """

    points: np.ndarray
    triangles: np.ndarray
    notes: list[str] = field(default_factory=list)


def mend(source: str, points: np.ndarray, triangles: np.ndarray) -> Mended:
    """Mend a welded surface, (n, 3) [m] and (m, 3), as far as that needs no guess of its shape.

    Edges where three triangles meet and places where the surface intersects itself remain.
    Raises InputError if a large hole leaves its shape open.
    """
    notes = []
    kept, wall_pairs = _drop_repeated(points, triangles)
    if (changed := len(triangles) - len(kept) - 2 * wall_pairs) > 0:
        notes.append(f"{changed} repeated or flat triangles removed")
    if wall_pairs:
        notes.append(f"{wall_pairs} pairs of triangles removed that two parts share, so that these are joined")
        points, kept = drop_unused(points, kept)
    size = float(np.ptp(points, axis=0).max())
    if find_holes(points, kept):
        welded = weld(points, kept, GAP)
        edges_before, edges_after = (sum(hole.edges for hole in find_holes(*mesh)) for mesh in ((points, kept), welded))
        if edges_after < edges_before:
            notes.append(f"points up to {in_words(GAP * size)} apart merged")
            points, kept = welded[0], _drop_repeated(*welded)[0]
    wound = orient(points, kept)
    changed = int((wound != kept).any(axis=1).sum())
    if changed == len(kept):
        notes.append("all triangles turned outward")
    elif changed:
        notes.append(f"{changed} of {len(kept)} triangles turned")
    holes = find_holes(points, wound)
    for hole in holes:
        if hole.width_m > (FLAT_HOLE if hole.flat else SMALL_HOLE) * size:
            place_words = ", ".join(f"{x:.3g}" for x in hole.centre_m)
            raise InputError(
                f"{source}: its surface has a hole of {hole.edges} edges, {in_words(hole.width_m)} across, around "
                f"({place_words}) m; close it in a mesh program, or download the file again if it was cut off."
            )
    if holes:
        largest = max(holes, key=lambda hole: hole.width_m)
        notes.append(f"{len(holes)} holes closed (the largest of {largest.edges} edges, {in_words(largest.width_m)})")
        points, closed = arrays(polydata(points, wound).fill_holes(float(np.linalg.norm(np.ptp(points, axis=0)))))
        wound = orient(points, closed)
    return Mended(points, wound, notes)


def orient(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Wind neighbouring triangles alike, and the outermost shells outward, (m, 3).

    A shell inside the largest keeps its winding relative to that: opposite around a hollow, alike if it is a part.
    """
    with_normals = polydata(points, triangles).compute_normals(
        split_vertices=False, consistent_normals=True, non_manifold_traversal=False
    )
    wound = arrays(with_normals)[1]
    label = label_shells(wound, len(points))
    # keep the winding that most triangles of a shell have in the file
    turned = (np.bincount(label, (wound != triangles).any(axis=1)) > 0.5 * np.bincount(label))[label]
    wound[turned] = wound[turned][:, ::-1]
    shells = [points[wound[label == number]] for number in range(label.max() + 1)]
    # six times that of each shell, negative if it is wound inward
    volumes = [
        signed_volumes(shell.reshape(-1, 3), np.arange(shell.size // 3).reshape(-1, 3)).sum() for shell in shells
    ]
    largest = int(np.argmax(np.abs(volumes)))
    lowest, highest = shells[largest].min(axis=(0, 1)), shells[largest].max(axis=(0, 1))
    for number, (shell, volume) in enumerate(zip(shells, volumes, strict=True)):
        if (volumes[largest] if ((shell > lowest) & (shell < highest)).all() else volume) < 0:
            wound[label == number] = wound[label == number][:, ::-1]
    return wound


def _drop_repeated(points: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, int]:
    """Drop triangles of no area, and all but one of those with the same corners, in the given order.

    Pairs wound in both senses, such as a wall that two parts share, are dropped altogether if fewer edges are open
    then; also returns how many these are.
    """
    area = np.linalg.norm(area_normals(points, triangles), axis=1)
    longest = np.ptp(points[triangles], axis=1).max(axis=1)
    solid = triangles[area > 1e-10 * longest**2]
    _, first_row, kind = np.unique(np.sort(solid, axis=1), axis=0, return_index=True, return_inverse=True)
    orientations = np.linalg.det(np.eye(3)[np.argsort(solid, axis=1)])
    in_both_senses = np.abs(np.bincount(kind.ravel(), orientations)) < 0.5
    single, unshared = np.sort(first_row), np.sort(first_row[~in_both_senses])
    open_edges, open_edges_without = ((triangle_edges(solid[numbers])[1] % 2).sum() for numbers in (single, unshared))
    return (solid[unshared], int(in_both_senses.sum())) if open_edges_without < open_edges else (solid[single], 0)
