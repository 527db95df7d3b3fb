"""The solid inside a mended surface, on a grid: robust where triangles overlap, touch or leave cracks."""

from dataclasses import dataclass, field
from functools import partial

import numpy as np
from scipy import ndimage

from palpate.bodies.ct.image import Grid
from palpate.bodies.mesh import area_normals, components, within
from palpate.bodies.mesh_file import in_words
from palpate.bodies.mesh_quality import is_closed
from palpate.bodies.surfaces.mend import Mended
from palpate.bodies.surfaces.tetrahedralize import label_shells
from palpate.bodies.surfaces.triangles import part_centres, volume
from palpate.errors import InputError


def winding_numbers(
    points: np.ndarray,
    triangles: np.ndarray,
    origin: np.ndarray,
    spacing: np.ndarray | float,
    shape: tuple[int, int, int],
) -> np.ndarray:
    """Estimate how often the triangles wind around each place of a grid, (nz, ny, nx): 1 inside, 0 outside.

    points, triangles : (n, 3) and (m, 3), wound outward
    origin, spacing, shape : first place (x, y, z), distance between places, numbers of places along z, y and x

    The mean of the signed crossings of six rays, along both senses of each axis (the generalised winding number of
    Jacobson, Kavan and Sorkine-Hornung 2013 is the mean of all rays). Where the surface is closed, all six agree; a ray
    that leaves through a hole is outvoted by the others. Where parts overlap, it is 2.
    """
    total = np.zeros(shape, dtype=np.float32)
    grid = (np.asarray(points) - origin) / spacing
    for axis in range(3):
        order = [(axis + 1) % 3, (axis + 2) % 3, axis]
        crossings = _along(grid[:, order], triangles, [shape[2 - other] for other in order])
        total += crossings.transpose([order.index(other) for other in (2, 1, 0)]) / 3
    return total


def _along(points: np.ndarray, triangles: np.ndarray, sizes: list[int]) -> np.ndarray:
    """Return for each place of a grid (u, v, w) the mean signed crossings of its two rays along the last axis."""
    corners, rays = points[triangles], np.indices(sizes[:2]).reshape(2, -1).T
    # places are at whole numbers, moved a little so that no ray meets an edge or a corner
    ray, triangle, weights = within(rays + np.array([0.000314159, 0.000271828]), corners[:, :, :2])
    inside = (weights > 0).all(axis=1)
    ray, triangle = ray[inside], triangle[inside]
    height = (weights[inside] * corners[triangle, :, 2]).sum(axis=1)
    crossings = np.zeros((len(rays), sizes[2] + 1), dtype=np.float32)
    # a ray leaves through a triangle that faces along it
    sense = -np.sign(area_normals(points, triangles)[triangle, 2]).astype(np.float32)
    np.add.at(crossings, (ray, np.clip(np.ceil(height), 0, sizes[2]).astype(np.int64)), sense)
    return (np.cumsum(crossings, axis=1) - crossings.sum(axis=1, keepdims=True) / 2)[:, :-1].reshape(sizes)


def sample(points: np.ndarray, triangles: np.ndarray, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """Spread places over a surface, at most about ``spacing`` apart: (k, 3), and their unit normals, (k, 3)."""
    a, b, c = (points[triangles[:, i]] for i in range(3))
    normals = area_normals(points, triangles)
    lengths = np.linalg.norm(normals, axis=1)
    longest = np.max([np.linalg.norm(p - q, axis=1) for p, q in ((a, b), (b, c), (c, a))], axis=0)
    parts = np.ceil(longest / spacing).astype(int)
    places, facings = [], []
    for count in np.unique(parts[lengths > 0]):
        of_count = np.flatnonzero((parts == count) & (lengths > 0))
        along, across = part_centres(count).T[:, :, None]
        sides = (b - a)[of_count, None], (c - a)[of_count, None]
        places.append((a[of_count, None] + along * sides[0] + across * sides[1]).reshape(-1, 3))
        facings.append(np.repeat(normals[of_count] / lengths[of_count, None], count**2, axis=0))
    return np.vstack(places), np.vstack(facings)


# voxels along the longest side, and a layer of empty ones around
RESOLUTION, MARGIN = 160, 3
# a voxel's least side over its largest, of a body thinner than a voxel
THINNEST = 0.125
# samples of the surface along the longest side
SAMPLES = 150
# other pieces larger than this fraction of the largest are not dropped but refused
LARGE_PIECE = 0.2
# a hollow smaller than this fraction of the solid is filled
SMALL_HOLLOW = 0.005


@dataclass
class Solid(Grid):
    """A body's interior on a grid, and places on its surface.

    mask : (nz, ny, nx) bool, of one piece; its hollows are in ``hollows``, each a mask, and filled in ``mask``
    volumes_m3 : within the triangles around ``mask`` and around each hollow [m³]; that of the mask where parts overlap
    places, normals : spread over the surface, (k, 3) [m] and (k, 3), outward
    notes : what was left out, each a few words with numbers
    """

    too_thin = (
        "the body is too thin beside its length to be remeshed; give a thicker one, tetrahedra that another program "
        "made, or for a cloth a body of kind sheet"
    )
    mask: np.ndarray
    hollows: list[np.ndarray]
    volumes_m3: list[float]
    origin_m: np.ndarray
    spacing_m: np.ndarray
    source: str
    places: np.ndarray
    normals: np.ndarray
    notes: list[str] = field(default_factory=list)

    @property
    def volume_m3(self) -> float:
        """The volume without the hollows."""
        return self.volumes_m3[0] - sum(self.volumes_m3[1:])


OVERLAP, INSIDE_OUT = 1.4, -0.4
"""Winding numbers above which parts overlap, and below which one is turned inside out."""


def solidify(source: str, mended: Mended) -> Solid:
    """Return the largest piece of the volume that a surface encloses, on a grid, and places on the piece's surface.

    Raises InputError if it encloses nothing, or several large pieces.
    """
    points, triangles = mended.points, mended.triangles
    extent = np.ptp(points, axis=0)
    size = float(extent.max())
    # whole cells across the body, with places in their middles: none lies on its ends, and a turned body has the same
    cells = np.maximum(np.ceil((1 - 1e-9) * RESOLUTION * extent / size), 1).astype(int)
    spacing = np.maximum(extent / cells, THINNEST * size / RESOLUTION)
    origin = points.min(axis=0) + extent / 2 - ((cells - 1) / 2 + MARGIN) * spacing
    nz, ny, nx = (cells + 2 * MARGIN)[::-1].tolist()
    winding = winding_numbers(points, triangles, origin, spacing, (nz, ny, nx))
    voxel_m3 = float(spacing.prod())
    inside = winding > 0.5
    pieces, count = ndimage.label(inside)
    if not count:
        raise InputError(f"{source}: its surface encloses no volume; give a closed surface.")
    sizes = np.bincount(pieces.ravel())[1:]
    mask = pieces == 1 + np.argmax(sizes)
    notes = _check_pieces(source, sizes, voxel_m3) or _specks(points, triangles, size / RESOLUTION)
    if winding.max() > OVERLAP:
        notes.append("parts that overlap joined (the triangles of a hollow must face inward)")
    filled = ndimage.binary_fill_holes(mask)
    hollows, note = _hollows(filled & ~mask, mask.sum(), voxel_m3)
    # where nothing overlaps, every place is clearly inside once or outside
    disjoint = bool(winding.max() < OVERLAP and winding.min() > INSIDE_OUT)
    masks = (filled, *hollows)
    # of a mask at places: 1 where it ends along the normal, -1 where it begins, 0 inside or outside
    drops = [partial(_drop_outward, mask=each, origin=origin, spacing=spacing) for each in masks]
    shell = _shells(points, triangles)
    middles, facing = points[triangles].mean(axis=1), area_normals(points, triangles)
    facing /= np.maximum(np.linalg.norm(facing, axis=1, keepdims=True), 1e-300)
    # the triangles around each mask: those of shells most of whose triangles lie on its surface
    on_surface = [np.abs(drop(middles, facing)) > 0.5 for drop in drops]
    around = [(np.bincount(shell, each) > 0.5 * np.bincount(shell))[shell] for each in on_surface]
    volumes = [
        abs(volume(points, triangles[its])) if disjoint and is_closed(triangles[its]) else float(each.sum() * voxel_m3)
        for its, each in zip(around, masks, strict=True)
    ]
    bounding = np.any(around, axis=0)
    parts = len(np.unique(shell[around[0]]))
    # a single shell bounds the solid as a whole: its thin parts, which the grid may miss, count
    single = disjoint and parts <= 1
    places, normals = sample(points, triangles[bounding] if single and bounding.any() else triangles, size / SAMPLES)
    if not single:
        if disjoint:
            notes.append(f"{parts} parts that touch, or lie less than {in_words(size / RESOLUTION)} apart, joined")
        # triangles between parts, and those inside where parts overlap, do not bound the solid
        ends = drops[0](places, normals) - sum(drop(places, normals) for drop in drops[1:])
        outer = np.abs(ends) > 0.5
        places, normals = places[outer], (np.sign(ends)[:, None] * normals)[outer]
    notes += [note] if note else []
    return Solid(filled, hollows, volumes, origin, spacing, source, places, normals, notes)


def _check_pieces(source: str, sizes: np.ndarray, voxel_m3: float) -> list[str]:
    """Note how many separate pieces are dropped; InputError if one of them is large."""
    smaller = np.sort(sizes)[::-1][1:]
    if not len(smaller):
        return []
    if smaller[0] > LARGE_PIECE * sizes.max():
        raise InputError(
            f"{source}: it has {len(sizes)} separate pieces, the largest of {1e6 * voxel_m3 * sizes.max():.0f} and "
            f"{1e6 * voxel_m3 * smaller[0]:.0f} mL; give each body a file of its own."
        )
    pieces = "1 separate piece" if len(smaller) == 1 else f"{len(smaller)} separate pieces"
    return [f"{pieces} dropped ({1e6 * voxel_m3 * smaller.sum():.2g} mL)"]


def _specks(points: np.ndarray, triangles: np.ndarray, spacing: float) -> list[str]:
    """Report how many shells are too small for the grid to see."""
    shell = label_shells(triangles, len(points))
    lowest, minus_highest = np.full((2, shell.max() + 1, 3), np.inf)
    np.minimum.at(lowest, shell, points[triangles].min(axis=1))
    np.minimum.at(minus_highest, shell, -points[triangles].max(axis=1))
    count = int(((-lowest - minus_highest).max(axis=1) < 3 * spacing).sum())
    words = "1 speck" if count == 1 else f"{count} specks"
    return [f"{words} dropped (less than {1e3 * 3 * spacing:.2g} mm across)"] if count else []


def _hollows(hollow: np.ndarray, volume: int, voxel_m3: float) -> tuple[list[np.ndarray], str]:
    """List the masks of large hollows, and note how many small ones are filled."""
    pieces, count = ndimage.label(hollow)
    sizes = np.bincount(pieces.ravel(), minlength=count + 1)[1:]
    large = np.flatnonzero(sizes > SMALL_HOLLOW * volume)
    small = np.delete(sizes, large)
    note = f"{len(small)} small hollows filled ({1e6 * voxel_m3 * small.sum():.2g} mL)" if len(small) else ""
    return [pieces == 1 + number for number in large], note


def _drop_outward(
    places: np.ndarray, normals: np.ndarray, mask: np.ndarray, origin: np.ndarray, spacing: np.ndarray
) -> np.ndarray:
    """Return how much the mask falls across each place along its normal, (k,): 1 on its surface, if that is outward."""
    field, step = mask.astype(np.float32), 1.5 * spacing * normals
    inner, outer = (((points - origin) / spacing).T[::-1] for points in (places - step, places + step))
    return ndimage.map_coordinates(field, inner, order=1) - ndimage.map_coordinates(field, outer, order=1)


def _shells(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Label each triangle with its piece of the surface, (m,): joined by edges that two triangles have, not more."""
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    _, edge_of_side, count = np.unique(edges[:, 0] * len(points) + edges[:, 1], return_inverse=True, return_counts=True)
    order = np.argsort(edge_of_side, kind="stable")
    return components(order[count[edge_of_side[order]] == 2].reshape(-1, 2) // 3, len(triangles))
