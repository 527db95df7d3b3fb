"""Mass density from CT numbers, and masses of an organ's voxels and of a mesh's nodes (paper 2, equation 4)."""

import warnings
from collections.abc import Sequence

import numpy as np
from scipy import ndimage

from palpate.bodies.ct.image import Image
from palpate.bodies.ct.segmentation import box_around
from palpate.bodies.mesh import Mesh, TetMesh
from palpate.bodies.particles import lump_masses
from palpate.bodies.settings import Ct
from palpate.errors import InputError

# Segments of the curve: the CT number [HU] up to which each holds, density at 0 HU [kg/m³], slope [kg/m³ per HU].
# Air to fat is interpolated between air at -1000 HU and the start of the next segment.
_AIR_HU, _AIR, _FAT_HU = -1000.0, 1.21, -98.0
_LINES = [
    (14.0, 1018.0, 0.893),  # fat to connective tissue, equation 21
    (23.0, 1030.0, 0.0),
    (100.0, 1003.0, 1.169),  # soft tissue, equation 23
    (np.inf, 1017.0, 0.592),  # bone, equation 19
]


def density(hu: np.ndarray | float) -> np.ndarray:
    """Compute the density [kg/m³] at CT numbers [HU], any shape; below -1000 HU it is that of air.

    W. Schneider, Bortfeld, Schlegel, "Correlation between CT numbers and tissue parameters needed for Monte Carlo
    simulations of clinical dose distributions", Phys. Med. Biol. 45 (2000) 459–478, equations 19, 21 and 23.
    Trap: contrast agent raises CT numbers but hardly the density, so that an enhanced liver comes out a few per cent
    too heavy; and the curve drops by 4 % at 100 HU, where soft tissue ends and bone begins.
    """
    hu = np.asarray(hu, dtype=np.float64)
    fat_density = _LINES[0][1] + _LINES[0][2] * _FAT_HU
    below_fat = np.interp(hu, [_AIR_HU, _FAT_HU], [_AIR, fat_density])
    return np.select(
        [hu < _FAT_HU, *(hu <= limit for limit, _, _ in _LINES)],
        [below_fat, *(at_0 + slope * hu for _, at_0, slope in _LINES)],
        default=np.nan,
    )


_MARGIN = 2  # voxels kept around the organ; beyond them the outermost ones are repeated


def nodal_densities(entry: Ct, levels: Sequence[Mesh]) -> list[np.ndarray]:
    """Interpolate the densities (n_nodes,) [kg/m³] at the nodes of each level, from its CT.

    The segmentation warns when the body's mesh is made, and not again here.
    """
    from palpate.bodies.ct.mesh_from_ct import segment_entry

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        image, mask = segment_entry(entry)
    return [organ_densities(mesh.nodes, image, mask) for mesh in levels]


def voxel_mass(image: Image, mask: np.ndarray) -> float:
    """Compute the mass [kg] of the voxels of ``mask``, (nz, ny, nx) bool."""
    return float(_densities(image, mask).sum() * image.voxel_m3)


def organ_densities(points: np.ndarray, image: Image, mask: np.ndarray) -> np.ndarray:
    """Interpolate the density [kg/m³] of the organ ``mask`` at points (n, 3) [m], trilinearly between voxel centres.

    The organ's outermost voxels and those outside first take the density of the nearest voxel further inside. Trap:
    the outermost ones contain in part the lung or fat beside the organ. Surface nodes, of which a coarse mesh mostly
    consists, would spread that deep into the organ (see ``raw_densities``).
    Raises InputError if the organ is empty, or if a point is outside of it by more than half its extent.
    """
    image, mask = _crop_to_organ(points, image, mask)
    core = ndimage.binary_erosion(mask, border_value=1)
    nearest_core = ndimage.distance_transform_edt(
        ~(core if core.any() else mask), sampling=image.spacing_m[::-1], return_distances=False, return_indices=True
    )
    return _trilinear(_densities(image)[tuple(nearest_core)], points, image)


def raw_densities(points: np.ndarray, image: Image, mask: np.ndarray) -> np.ndarray:
    """Interpolate the density of the unmodified voxels, as in paper 2; otherwise like ``organ_densities``."""
    image, _ = _crop_to_organ(points, image, mask)
    return _trilinear(_densities(image), points, image)


def node_masses(mesh: TetMesh, densities: np.ndarray) -> np.ndarray:
    """Compute masses (n_nodes,) [kg]: a quarter of those of the tetrahedra around each node (paper 2, eq. 4).

    A tetrahedron weighs its volume times the mean of the densities (n_nodes,) [kg/m³] at its nodes.
    """
    return lump_masses(mesh, mesh.volumes * densities[mesh.tetrahedra].mean(axis=1))


def _densities(image: Image, where: np.ndarray | None = None) -> np.ndarray:
    """Return the density [kg/m³] of a CT's voxels; InputError for an MRI, whose grey values say nothing of it."""
    if image.modality != "ct":
        raise InputError(f"{image.source}: an MRI does not show how dense tissue is; give density_kg_m3, or a CT.")
    return density(image.hu if where is None else image.hu[where])


def _crop_to_organ(points: np.ndarray, image: Image, mask: np.ndarray) -> tuple[Image, np.ndarray]:
    """Crop image and mask to the organ; InputError if it is empty, or if points (n, 3) [m] lie far outside."""
    if not mask.any():
        raise InputError(f"{image.source}: the mask is empty; give one that marks the organ.")
    box = box_around(mask, _MARGIN)
    cropped = image.cropped(box)
    from_middle = cropped.to_index(points) / (np.array(cropped.hu.shape) - 1) - 0.5
    if (np.abs(from_middle) > 1).any():
        raise InputError(
            f"{image.source}: the mesh has nodes far outside the organ; give both in one frame, in metres."
        )
    return cropped, mask[box]


def _trilinear(voxels: np.ndarray, points: np.ndarray, image: Image) -> np.ndarray:
    return ndimage.map_coordinates(voxels, image.to_index(points).T, order=1, mode="nearest")
