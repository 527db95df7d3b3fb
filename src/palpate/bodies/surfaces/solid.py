"""The solid inside a mended surface, on a grid: robust where triangles overlap, touch or leave cracks."""

from dataclasses import dataclass, field

import numpy as np
from scipy import ndimage

from palpate.bodies.surfaces.decimate import area_normals
from palpate.bodies.surfaces.mend import Mended
from palpate.bodies.surfaces.samples import sample
from palpate.bodies.surfaces.tetrahedralize import label_shells
from palpate.bodies.surfaces.winding import winding_numbers
from palpate.errors import InputError

# voxels along the longest side, and a layer of empty ones around
RESOLUTION, MARGIN = 160, 3
# samples of the surface along the longest side
SAMPLES = 150
# other pieces larger than this fraction of the largest are not dropped but refused
LARGE_PIECE = 0.2
# a hollow smaller than this fraction of the solid is filled
SMALL_HOLLOW = 0.005


@dataclass
class Solid:
    """A body's interior on a grid, and places on its surface.

    mask : (nz, ny, nx) bool, of one piece; its hollows are in ``hollows``, each a mask, and filled in ``mask``
    origin_m, spacing_m, source : the grid, as of a CT's image
    places, normals : spread over the surface, (k, 3) [m] and (k, 3), outward
    notes : what was left out, each a few words with numbers
    """

    mask: np.ndarray
    hollows: list[np.ndarray]
    origin_m: np.ndarray
    spacing_m: np.ndarray
    source: str
    places: np.ndarray
    normals: np.ndarray
    notes: list[str] = field(default_factory=list)

    @property
    def voxel_m3(self) -> float:
        """Volume of a voxel [m³]."""
        return float(np.prod(self.spacing_m))

    def to_world(self, index: np.ndarray) -> np.ndarray:
        """Convert array indices, (n, 3) in z y x, to coordinates, (n, 3) [m] in x y z."""
        return self.origin_m + np.asarray(index)[..., ::-1] * self.spacing_m


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
    places, normals = _boundary_places(points, triangles, filled & ~hollow, origin, spacing, _is_simple(winding))
    return Solid(
        filled, hollows, origin, np.full(3, spacing), source, places, normals, notes + ([note] if note else [])
    )


def _check_pieces(source: str, sizes: np.ndarray, voxel_m3: float) -> list[str]:
    rest = np.sort(sizes)[::-1][1:]
    if not len(rest):
        return []
    if rest[0] > LARGE_PIECE * sizes.max():
        raise InputError(
            f"{source}: it has {len(sizes)} separate pieces, the largest of {1e6 * voxel_m3 * sizes.max():.0f} and "
            f"{1e6 * voxel_m3 * rest[0]:.0f} mL; give each body a file of its own."
        )
    return [f"{len(rest)} separate pieces dropped ({1e6 * voxel_m3 * rest.sum():.2g} mL)"]


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


def _is_simple(winding: np.ndarray) -> bool:
    """Test whether nothing overlaps: every place is clearly inside once or outside."""
    return bool(winding.max() < 1.4 and winding.min() > -0.4)


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
