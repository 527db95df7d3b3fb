"""The solid inside a mended surface, on a grid: robust where triangles overlap, touch or leave cracks."""

from dataclasses import dataclass, field

import numpy as np
from scipy import ndimage

from palpate.bodies.ct.image import Grid
from palpate.bodies.mesh import area_normals
from palpate.bodies.surfaces.mend import Mended
from palpate.bodies.surfaces.tetrahedralize import label_shells
from palpate.bodies.surfaces.triangles import polydata
from palpate.errors import InputError


def winding_numbers(
    points: np.ndarray, triangles: np.ndarray, origin: np.ndarray, spacing: float, shape: tuple[int, int, int]
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
        counts = _along(grid[:, order], triangles, [shape[2 - a] for a in order])
        total += counts.transpose([order.index(a) for a in (2, 1, 0)]) / 3
    return total


def _along(points: np.ndarray, triangles: np.ndarray, sizes: list[int]) -> np.ndarray:
    """Compute the mean count of the two rays along the last axis, for each place, (u, v, w)."""
    a, b, c = (points[triangles[:, i]] for i in range(3))
    # twice the area seen along the ray, positive where the triangle faces it
    twice = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    corners = np.stack([a, b, c])
    # places are at whole numbers, moved a little so that no ray meets an edge or a corner
    shift = np.array([0.000314159, 0.000271828])
    low = np.clip(np.ceil(corners[:, :, :2].min(axis=0) - shift), 0, None).astype(np.int64)
    high = np.minimum(np.floor(corners[:, :, :2].max(axis=0) - shift), np.array(sizes[:2]) - 1).astype(np.int64)
    wide = np.clip(high - low + 1, 0, None)
    wide[twice == 0] = 0
    rays = wide.prod(axis=1)
    which = np.repeat(np.arange(len(triangles)), rays)
    number = np.arange(len(which)) - np.repeat(np.cumsum(rays) - rays, rays)
    u = low[which, 0] + number // wide[which, 1]
    v = low[which, 1] + number % wide[which, 1]
    at = np.column_stack([u, v]) + shift
    weights = np.stack([_twice_area(p[which], q[which], at) for p, q in ((b, c), (c, a), (a, b))]) / twice[which]
    inside = (weights > 0).all(axis=0)
    which, u, v, weights = which[inside], u[inside], v[inside], weights[:, inside]
    height = (weights * corners[:, which, 2]).sum(axis=0)
    crossings = np.zeros((sizes[0], sizes[1], sizes[2] + 1), dtype=np.float32)
    # a ray leaves through a triangle that faces along it
    places = u, v, np.clip(np.ceil(height), 0, sizes[2]).astype(np.int64)
    np.add.at(crossings, places, -np.sign(twice[which]).astype(np.float32))
    return (np.cumsum(crossings, axis=2) - crossings.sum(axis=2, keepdims=True) / 2)[:, :, :-1]


def _twice_area(p: np.ndarray, q: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Compute twice the signed area, seen along the ray, of the triangles of an edge and a place, (n,)."""
    return (q[:, 0] - p[:, 0]) * (at[:, 1] - p[:, 1]) - (q[:, 1] - p[:, 1]) * (at[:, 0] - p[:, 0])


def sample(points: np.ndarray, triangles: np.ndarray, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """Spread places over a surface, at most about ``spacing`` apart: (k, 3), and their unit normals, (k, 3)."""
    a, b, c = (points[triangles[:, i]] for i in range(3))
    normals = area_normals(points, triangles)
    lengths = np.linalg.norm(normals, axis=1)
    longest = np.max([np.linalg.norm(p - q, axis=1) for p, q in ((a, b), (b, c), (c, a))], axis=0)
    parts = np.ceil(longest / spacing).astype(int)
    places, facing = [], []
    for count in np.unique(parts[lengths > 0]):
        chosen = np.flatnonzero((parts == count) & (lengths > 0))
        u, v = (x.ravel() for x in np.meshgrid(np.arange(count), np.arange(count)))
        # centres of the triangles that each is split into
        first, second = u + v < count, u + v < count - 1
        along = np.concatenate([u[first] + 1 / 3, u[second] + 2 / 3])[:, None] / count
        across = np.concatenate([v[first] + 1 / 3, v[second] + 2 / 3])[:, None] / count
        sides = (b - a)[chosen, None], (c - a)[chosen, None]
        places.append((a[chosen, None] + along * sides[0] + across * sides[1]).reshape(-1, 3))
        facing.append(np.repeat(normals[chosen] / lengths[chosen, None], len(along), axis=0))
    return np.vstack(places), np.vstack(facing)


def distances(places: np.ndarray, points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Compute the distance of places, (k, 3), from a surface, (k,)."""
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkFiltersGeneral import vtkDistancePolyDataFilter

    measure = vtkDistancePolyDataFilter()
    # VTK wants a cell; the distances are those of the points
    measure.SetInputData(0, polydata(places, np.zeros((1, 3), dtype=np.int64)))
    measure.SetInputData(1, polydata(points, triangles))
    measure.SignedDistanceOff()
    measure.ComputeSecondDistanceOff()
    measure.ComputeCellCenterDistanceOff()
    measure.Update()
    return np.abs(vtk_to_numpy(measure.GetOutput().GetPointData().GetArray("Distance")))


# voxels along the longest side, and a layer of empty ones around
RESOLUTION, MARGIN = 160, 3
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
    places, normals : spread over the surface, (k, 3) [m] and (k, 3), outward
    notes : what was left out, each a few words with numbers
    """

    too_thin = (
        "the body is too thin beside its length to be remeshed; give a thicker one, tetrahedra that another program "
        "made, or for a cloth a body of kind sheet"
    )
    mask: np.ndarray
    hollows: list[np.ndarray]
    origin_m: np.ndarray
    spacing_m: np.ndarray
    source: str
    places: np.ndarray
    normals: np.ndarray
    notes: list[str] = field(default_factory=list)

    @property
    def volume_m3(self) -> float:
        """The volume without the hollows."""
        return float((self.mask.sum() - sum(hollow.sum() for hollow in self.hollows)) * self.voxel_m3)


def solidify(source: str, mended: Mended) -> Solid:
    """Find the largest piece of what a surface encloses, and the places on its surface.

    Raises InputError if it encloses nothing, or several large pieces.
    """
    points, triangles = mended.points, mended.triangles
    extent = np.ptp(points, axis=0)
    spacing = float(extent.max()) / RESOLUTION
    origin = points.min(axis=0) - MARGIN * spacing
    nz, ny, nx = (np.ceil(extent / spacing).astype(int) + 2 * MARGIN + 1)[::-1].tolist()
    winding = winding_numbers(points, triangles, origin, spacing, (nz, ny, nx))
    inside = winding > 0.5
    pieces, count = ndimage.label(inside)
    if not count:
        raise InputError(f"{source}: its surface encloses no volume; give a closed surface.")
    sizes = np.bincount(pieces.ravel())[1:]
    mask = pieces == 1 + np.argmax(sizes)
    notes = _check_pieces(source, sizes, spacing**3) or _specks(points, triangles, spacing)
    if winding.max() > 1.4:
        notes.append("parts that overlap joined (the triangles of a hollow must face inward)")
    filled = ndimage.binary_fill_holes(mask)
    hollows, note = _hollows(filled & ~mask, mask.sum(), spacing**3)
    hollow = np.any(hollows, axis=0) if hollows else np.zeros_like(mask)
    # where nothing overlaps, every place is clearly inside once or outside
    simple = bool(winding.max() < 1.4 and winding.min() > -0.4)
    places, normals = _boundary_places(points, triangles, filled & ~hollow, origin, spacing, simple)
    notes += [note] if note else []
    return Solid(filled, hollows, origin, np.full(3, spacing), source, places, normals, notes)


def _check_pieces(source: str, sizes: np.ndarray, voxel_m3: float) -> list[str]:
    rest = np.sort(sizes)[::-1][1:]
    if not len(rest):
        return []
    if rest[0] > LARGE_PIECE * sizes.max():
        raise InputError(
            f"{source}: it has {len(sizes)} separate pieces, the largest of {1e6 * voxel_m3 * sizes.max():.0f} and "
            f"{1e6 * voxel_m3 * rest[0]:.0f} mL; give each body a file of its own."
        )
    pieces = "1 separate piece" if len(rest) == 1 else f"{len(rest)} separate pieces"
    return [f"{pieces} dropped ({1e6 * voxel_m3 * rest.sum():.2g} mL)"]


def _specks(points: np.ndarray, triangles: np.ndarray, spacing: float) -> list[str]:
    """Report how many shells are too small for the grid to see."""
    label = label_shells(triangles, len(points))
    order = np.argsort(label, kind="stable")
    firsts = np.unique(label[order], return_index=True)[1]
    corners = points[triangles[order]]
    low = np.minimum.reduceat(corners.min(axis=1), firsts)
    high = np.maximum.reduceat(corners.max(axis=1), firsts)
    count = int(((high - low).max(axis=1) < 3 * spacing).sum())
    what = "1 speck" if count == 1 else f"{count} specks"
    return [f"{what} dropped (less than {1e3 * 3 * spacing:.2g} mm across)"] if count else []


def _hollows(hollow: np.ndarray, volume: int, voxel_m3: float) -> tuple[list[np.ndarray], str]:
    """List the hollows that are kept, and say how many are not."""
    label, count = ndimage.label(hollow)
    sizes = np.bincount(label.ravel(), minlength=count + 1)[1:]
    large = np.flatnonzero(sizes > SMALL_HOLLOW * volume)
    small = np.delete(sizes, large)
    note = f"{len(small)} small hollows filled ({1e6 * voxel_m3 * small.sum():.2g} mL)" if len(small) else ""
    return [label == 1 + number for number in large], note


def _boundary_places(
    points: np.ndarray, triangles: np.ndarray, mask: np.ndarray, origin: np.ndarray, spacing: float, simple: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Spread places over the triangles that bound the mask, and orient their normals outward."""
    field = mask.astype(np.float32)

    def steps(places: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Compute by how much less of the mask there is outward of each place than inward, -1 to 1."""
        step = 1.5 * spacing * normals
        inner, outer = (((at - origin) / spacing).T[::-1] for at in (places - step, places + step))
        return ndimage.map_coordinates(field, inner, order=1) - ndimage.map_coordinates(field, outer, order=1)

    if simple:
        # whole shells bound it or do not: thin parts, which the grid may miss, are kept
        label = label_shells(triangles, len(points))
        normals = area_normals(points, triangles)
        lengths = np.linalg.norm(normals, axis=1, keepdims=True)
        bounds = np.abs(steps(points[triangles].mean(axis=1), normals / np.maximum(lengths, 1e-300))) > 0.5
        shells = [number for number in np.unique(label) if bounds[label == number].mean() > 0.5]
        kept = np.isin(label, shells) if shells else np.ones(len(label), dtype=bool)
        return sample(points, triangles[kept], RESOLUTION * spacing / SAMPLES)
    places, normals = sample(points, triangles, RESOLUTION * spacing / SAMPLES)
    change = steps(places, normals)
    # where parts overlap, triangles inside the solid do not bound it
    bounds = np.abs(change) > 0.5
    return places[bounds], (np.sign(change)[:, None] * normals)[bounds]
