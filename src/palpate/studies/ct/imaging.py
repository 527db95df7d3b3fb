"""Measure the steps from a scan to a picture and a mask (paper 3, chapter 2) against known answers."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.ndimage import gaussian_filter

from palpate.bodies.ct import synthetic_abdomen
from palpate.bodies.ct.image import Image
from palpate.bodies.ct.segmentation import even_brightness, fill_between, segment
from palpate.bodies.surfaces.mask_surface import isosurface
from palpate.bodies.surfaces.remesh import area_normals, vertex_normals
from palpate.errors import InputError
from palpate.studies.ct import ray_casting
from palpate.studies.ct.settings import Imaging
from palpate.table_declaration import Table

NEAREST, BETWEEN = "nearest slice", "signed distance"

MASK_INTERPOLATION = Table(
    "mask_interpolation",
    "The mask of each body, drawn on every n-th slice and filled between, against the whole mask.",
    """
    body every method: a body, n, and how slices are filled
    dice volume_deviation: Dice coefficient, and relative deviation of the volume
    """,
)


def mask_interpolation(name: str, image: Image, mask: np.ndarray, every: Sequence[int]) -> pd.DataFrame:
    """Compute the rows of mask_interpolation.csv: the mask of a body against its interpolation from every n-th slice.

    every : the n that are tried, with slices across z; each from two first slices, of which the worse counts
    The methods are the nearest drawn slice, and signed distances (``fill_between``). Where fewer than two slices of the
    organ are drawn, there is no row.
    """
    rows = []
    for n in every:
        for method in (NEAREST, BETWEEN):
            scores_of_starts = [_compare(method, image, mask, only_every(mask, n, first)) for first in (0, n // 2)]
            compared = [scores for scores in scores_of_starts if scores is not None]
            if compared:
                rows.append((name, n, method, *min(compared)))
    return MASK_INTERPOLATION.frame(rows)


def only_every(mask: np.ndarray, n: int, first: int) -> np.ndarray:
    """Return a mask (nz, ny, nx) with every n-th slice only, counted from its slice number ``first`` of the organ."""
    start = (int(np.flatnonzero(mask.any(axis=(1, 2)))[0]) + first) % n
    drawn = np.zeros_like(mask)
    drawn[start::n] = mask[start::n]
    return drawn


def dice(first: np.ndarray, second: np.ndarray) -> float:
    """Return the Dice coefficient of two masks, 2 |a ∩ b| / (|a| + |b|): 1 if they are equal, 0 if disjoint."""
    return float(2 * (first & second).sum() / (first.sum() + second.sum()))


def _compare(method: str, image: Image, mask: np.ndarray, drawn: np.ndarray) -> tuple[float, float] | None:
    """Interpolate ``drawn`` slices of a mask, and return Dice coefficient and relative deviation of the volume."""
    slices = np.flatnonzero(drawn.any(axis=(1, 2)))
    if len(slices) < 2:
        return None
    if method == BETWEEN:
        filled = fill_between(drawn, image, "z", Path(image.source))
    else:
        half_gap = (slices[1] - slices[0]) // 2
        numbers = np.arange(len(mask))
        nearest = slices[np.abs(numbers[:, None] - slices).argmin(axis=1)]
        filled = np.where((np.abs(numbers - nearest) <= half_gap)[:, None, None], drawn[nearest], False)
    return dice(filled, mask), float(filled.sum() / mask.sum() - 1)


SAME_ORGAN_DISTANCE = 0.06  # points farther from the exact surface, over the half axes, belong to another organ
GRADIENT, CORNERS, TRIANGLES = "gradient", "triangles around", "triangle"

SURFACE_NORMALS = Table(
    "surface_normals",
    "Angles of a surface's normals to those of the exact liver, and the distance of its points from it.",
    """
    blur_voxels normals_from: blur before the surface is taken [finest spacing], and source of the normals
    points median_deg p95_deg: number of points, and angles to the exact normal [°]
    rms_m: distance of the points from the exact surface [m]
    """,
)


def surface_normals(image: Image) -> pd.DataFrame:
    """Compute the rows of surface_normals.csv for the liver of the synthetic abdomen's scan ``image``.

    Normals are those of the gradient of the grey values by central differences, the mean of the triangles around a
    point, weighted with their areas, or those of single triangles.
    """
    level, rows = (synthetic_abdomen.LIVER_HU + synthetic_abdomen.FAT_HU) / 2, []
    for blur in (0.0, 1.0):
        steps = blur * image.spacing_m.min() / image.spacing_m[::-1]
        grey = gaussian_filter(image.hu.astype(np.float32), steps)
        points, triangles, slopes = isosurface(grey, level, image.origin_m, image.spacing_m, normals=True)
        for source, places, normals in _sources(points, triangles, slopes):
            scale, exact = liver_side(places)
            of_liver = np.abs(scale - 1) < SAME_ORGAN_DISTANCE
            cosines = np.abs(np.einsum("ij,ij->i", normals[of_liver], exact[of_liver]))
            angles = np.degrees(np.arccos(np.clip(cosines, 0, 1)))
            distances = np.linalg.norm(places[of_liver] - _onto(places[of_liver]), axis=1)
            median, p95 = np.percentile(angles, [50, 95])
            rows.append((blur, source, int(of_liver.sum()), median, p95, float(np.sqrt((distances**2).mean()))))
    return SURFACE_NORMALS.frame(rows)


def _sources(
    points: np.ndarray, triangles: np.ndarray, slopes: np.ndarray
) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
    """Yield each kind of normals: its name, points (n, 3) [m] and unit normals (n, 3); flat triangles have none."""
    yield GRADIENT, points, slopes
    areas = area_normals(points, triangles)
    sizes = np.linalg.norm(areas, axis=1)
    has_area = sizes > 0
    used_points, corners = np.unique(triangles[has_area], return_inverse=True)
    yield CORNERS, points[used_points], vertex_normals(points[used_points], corners.reshape(-1, 3))
    yield TRIANGLES, points[triangles[has_area]].mean(axis=1), areas[has_area] / sizes[has_area, None]


def _onto(points: np.ndarray) -> np.ndarray:
    """Project points (n, 3) [m] near the exact liver onto its surface along its normals, by Newton's method."""
    projected = points.copy()
    for _ in range(4):
        scale, normals = liver_side(projected)
        scale_ahead = liver_side(projected + 1e-6 * normals)[0]
        projected -= ((scale - 1) / (scale_ahead - scale) * 1e-6)[:, None] * normals
    return projected


def liver_side(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the scale of the ellipsoid through each point (n, 3) [m] over that of the liver, and its unit normal.

    The scale (n,) is 1 on the liver's surface and less than 1 inside.
    """
    _, centre, axes, turn = synthetic_abdomen.SHAPES["liver"]
    x, y, z = (points - np.array(centre)).T
    long_axis, short_axis = np.cos(turn) * x + np.sin(turn) * z, np.cos(turn) * z - np.sin(turn) * x
    a, b, c = long_axis / axes[0] ** 2, y / axes[1] ** 2, short_axis / axes[2] ** 2
    normals = np.column_stack([np.cos(turn) * a - np.sin(turn) * c, b, np.sin(turn) * a + np.cos(turn) * c])
    return synthetic_abdomen.ellipsoid_radius(x, y, z, axes, turn), normals / np.linalg.norm(
        normals, axis=1, keepdims=True
    )


SEGMENTED_SCANS = Table(
    "segmented_scans",
    "The liver found by one range of grey values in a synthetic CT and MRI, against the true one.",
    """
    scan dice volume_deviation: a scan, Dice coefficient, and relative deviation of the volume
    """,
)


def segmented_scans(ct: Image, liver: np.ndarray) -> tuple[pd.DataFrame, list[tuple[Image, np.ndarray]]]:
    """Compute the rows of segmented_scans.csv; also return the MRI as it is and evened, each with its segmented liver.

    ct, liver : the synthetic abdomen and the mask of its liver (nz, ny, nx)
    Where nothing is segmented, dice is 0.
    """
    uneven = synthetic_abdomen.mri_abdomen(spacing_m=ct.spacing_m.tolist())[0]
    rows, shown = [], []
    for scan, image in (("CT", ct), ("MRI", uneven), ("MRI, evened", even_brightness(uneven))):
        limits = (30, 120) if image.modality == "ct" else synthetic_abdomen.LIVER_SIGNALS
        try:
            segmented = segment(image, limits)
        except InputError:
            segmented = np.zeros(image.hu.shape, dtype=bool)
        volume = float(segmented.sum() / liver.sum() - 1)
        rows.append((scan, dice(segmented, liver), volume))
        if image.modality == "mri":
            shown.append((image, segmented))
    return SEGMENTED_SCANS.frame(rows), shown


TISSUE_CLASSES = Table(
    "tissue_classes",
    "The tissues that voxels are taken for, by three methods, against what the synthetic abdomen is made of.",
    """
    method tissue: thresholds, probability of a fitted mixture or percentage; and a tissue
    wrong: share of its voxels that are taken for another
    rms_error: error of its share in a voxel, over all voxels
    """,
)


def tissue_classes(image: Image) -> pd.DataFrame:
    """Compute the rows of tissue_classes.csv for the synthetic abdomen's CT ``image``.

    Methods are thresholds midway between usual grey values, the probability of a mixture that is fitted to the
    histogram, and percentages of two neighbouring tissues. A voxel belongs to the tissue that fills most of it.
    """
    truth = _shares(image)
    mixture = ray_casting.fit_mixture(image.hu, [tissue.hu for tissue in ray_casting.TISSUES])
    methods = {
        "threshold": ray_casting.by_threshold,
        "probability": lambda grey: ray_casting.probabilities(mixture, grey),
        "percentage": ray_casting.by_percentage,
    }
    rows = []
    for method, classify in methods.items():
        fractions = classify(image.hu.astype(np.float32))
        for k, tissue in enumerate(ray_casting.TISSUES):
            of_tissue = truth.argmax(axis=0) == k
            error = float(np.sqrt(((fractions - truth)[k] ** 2).mean()))
            rows.append((method, tissue.name, float((fractions.argmax(axis=0) != k)[of_tissue].mean()), error))
    return TISSUE_CLASSES.frame(rows)


def shape_shares(spacing_m: Sequence[float]) -> dict[str, np.ndarray]:
    """Compute the visible fraction of each voxel (nz, ny, nx) by the shape that fills it; later shapes hide earlier."""
    shares: dict[str, np.ndarray] = {}
    for name, fraction in synthetic_abdomen.shape_fractions(spacing_m)[1].items():
        shares = {other: share * (1 - fraction) for other, share in shares.items()} | {name: fraction}
    return shares


def _shares(image: Image) -> np.ndarray:
    """Return the fraction of each voxel that each tissue fills, (k, nz, ny, nx); what no shape fills is a gap."""
    shares = shape_shares(image.spacing_m.tolist())
    truth = np.zeros((len(ray_casting.TISSUES), *image.hu.shape), dtype=np.float32)
    for name, (hu, *_) in synthetic_abdomen.SHAPES.items():
        truth[np.searchsorted(ray_casting.thresholds(), hu)] += shares[name]
    truth[0] += 1 - truth.sum(axis=0)
    return truth


STEP = 0.5  # of the smallest side of a voxel, between samples along a ray
OPAQUE = 0.99  # opacity at which rays of the pictures end


class Pictures(NamedTuple):
    """Material of the figure.

    cast : pictures (height, width, 3) by caption; taken : part of the samples that early ended rays take, by pixel
    mris : the MRI as it is and evened, each with the mask (nz, ny, nx) of its segmented liver; liver : the true mask
    """

    cast: dict[str, np.ndarray]
    taken: np.ndarray
    mris: list[tuple[Image, np.ndarray]]
    liver: np.ndarray


def measure(
    masks: Mapping[str, tuple[Image, np.ndarray]], settings: Imaging, progress: Callable = iter
) -> tuple[dict[str, pd.DataFrame], Pictures]:
    """Measure the tables of this module and of ray casting, by name; also return what the figure shows.

    masks : image and organ of each body; progress : wraps the list of tables
    """
    image, truth = synthetic_abdomen.abdomen(spacing_m=(settings.voxel_m,) * 3)
    rays = ray_casting.parallel_rays(image, ray_casting.front(), settings.pixels, STEP)
    interpolations = (mask_interpolation(body, *scan, settings.every) for body, scan in masks.items())
    scans, mris = segmented_scans(image, truth["liver"])
    measures: dict[str, Callable[[], pd.DataFrame]] = {
        "mask_interpolation": lambda: pd.concat(interpolations, ignore_index=True),
        "surface_normals": lambda: surface_normals(image),
        "tissue_classes": lambda: tissue_classes(image),
        "segmented_scans": lambda: scans,
        "compositing": lambda: ray_casting.compositing(ray_casting.field_of(image), rays, ray_casting.likely(image)),
    }
    tables = {name: measures[name]() for name in progress(list(measures))}
    return tables, Pictures(*_pictures(image, rays), mris, truth["liver"])


def _pictures(image: Image, rays: ray_casting.Rays) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Cast the figure's pictures by caption, and return the part of the samples that early ended rays take."""
    field, transfer = ray_casting.field_of(image), ray_casting.likely(image)
    by_threshold = ray_casting.transfer_of(ray_casting.GREY, ray_casting.by_threshold(ray_casting.GREY))
    back_first = ray_casting.cast(field, transfer, rays, back_to_front=True)
    front_first, samples = ray_casting.cast(field, transfer, rays, enough=OPAQUE)
    shape = rays.height, rays.width
    shown = {
        "classes by threshold": ray_casting.cast(field, by_threshold, rays)[0],
        "by probability, back to front": back_first[0],
        f"front to back, ends at {OPAQUE:g}": front_first,
    }
    pictures = {caption: ray_casting.on_white(seen).reshape(*shape, 3) for caption, seen in shown.items()}
    return pictures, (samples / np.maximum(back_first[1], 1)).reshape(shape)
