"""Normals of a surface from grey values and from triangles, against the exact ones (paper 3, chapter 2)."""

from collections.abc import Iterator

import numpy as np
import pandas as pd
from scipy.ndimage import gaussian_filter

from palpate.bodies.ct.image import Image
from palpate.bodies.ct.synthetic_abdomen import FAT_HU, LIVER_HU, liver_side
from palpate.bodies.surfaces.mask_surface import isosurface
from palpate.bodies.surfaces.triangles import area_normals, vertex_normals

NEAR = 0.06
"""Points so far from the exact surface, relative to the half axes, belong to another organ."""
GRADIENT, CORNERS, TRIANGLES = "gradient", "triangles around", "triangle"


def measure(image: Image) -> pd.DataFrame:
    """Compute the rows of surface_normals.csv for the liver of the synthetic abdomen's scan ``image``.

    blur_voxels : deviation of the blur before the surface is taken, in voxels of the finest spacing
    normals_from : the gradient of the grey values by central differences; the mean of the triangles around a point, by
    their areas; or each triangle itself. median_deg, p95_deg : angles to the exact normal; rms_m : distance of the
    points from the exact surface [m]
    """
    level, rows = (LIVER_HU + FAT_HU) / 2, []
    for blur in (0.0, 1.0):
        steps = blur * image.spacing_m.min() / image.spacing_m[::-1]
        grey = gaussian_filter(image.hu.astype(np.float32), steps)
        points, triangles, slopes = isosurface(grey, level, image.origin_m, image.spacing_m, normals=True)
        for source, places, normals in _sources(points, triangles, slopes):
            side, exact = liver_side(places)
            near = np.abs(side - 1) < NEAR
            cosines = np.abs(np.einsum("ij,ij->i", normals[near], exact[near]))
            angles = np.degrees(np.arccos(np.clip(cosines, 0, 1)))
            far = np.linalg.norm(places[near] - _onto(places[near]), axis=1)
            median, p95 = np.percentile(angles, [50, 95])
            rows.append((blur, source, int(near.sum()), median, p95, float(np.sqrt((far**2).mean()))))
    return pd.DataFrame(rows, columns=["blur_voxels", "normals_from", "points", "median_deg", "p95_deg", "rms_m"])


def _sources(
    points: np.ndarray, triangles: np.ndarray, slopes: np.ndarray
) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
    """Yield each kind of normals, (n, 3), with the places that they belong to, (n, 3) [m]; not of flat triangles."""
    yield GRADIENT, points, slopes
    areas = area_normals(points, triangles)
    sizes = np.linalg.norm(areas, axis=1)
    whole = sizes > 0
    used, corners = np.unique(triangles[whole], return_inverse=True)
    yield CORNERS, points[used], vertex_normals(points[used], corners.reshape(-1, 3))
    yield TRIANGLES, points[triangles[whole]].mean(axis=1), areas[whole] / sizes[whole, None]


def _onto(points: np.ndarray) -> np.ndarray:
    """Move points near the exact liver along its normals onto it, by a few steps of Newton's method."""
    found = points.copy()
    for _ in range(4):
        side, normals = liver_side(found)
        ahead = liver_side(found + 1e-6 * normals)[0]
        found -= ((side - 1) / (ahead - side) * 1e-6)[:, None] * normals
    return found
