"""Steps from a scan to a picture and a mask that paper 3 describes in chapter 2, each against what is known."""

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
    """Compute the rows of mask_interpolation.csv: how far the mask of a body comes back from every n-th slice.

    dice : the lower of two ways to begin; method : the nearest drawn slice, or signed distances (``fill_between``)
    Slices are drawn across z. An organ with fewer than two drawn ones has no row.
    """
    rows = []
    for n in every:
        for method in (NEAREST, BETWEEN):
            tried = [_compare(method, image, mask, only_every(mask, n, first)) for first in (0, n // 2)]
            found = [one for one in tried if one is not None]
            if found:
                rows.append((name, n, method, *min(found)))
    return MASK_INTERPOLATION.frame(rows)


def only_every(mask: np.ndarray, n: int, first: int) -> np.ndarray:
    """Keep every n-th slice of a mask, (nz, ny, nx) bool, counted from one of its own."""
    start = (int(np.flatnonzero(mask.any(axis=(1, 2)))[0]) + first) % n
    drawn = np.zeros_like(mask)
    drawn[start::n] = mask[start::n]
    return drawn


def dice(first: np.ndarray, second: np.ndarray) -> float:
    """Return how far two masks agree, 2 |a ∩ b| / (|a| + |b|): 1 if they are the same, 0 without a common voxel."""
    return float(2 * (first & second).sum() / (first.sum() + second.sum()))


def _compare(method: str, image: Image, mask: np.ndarray, drawn: np.ndarray) -> tuple[float, float] | None:
    slices = np.flatnonzero(drawn.any(axis=(1, 2)))
    if len(slices) < 2:
        return None
    if method == BETWEEN:
        filled = fill_between(drawn, image, "z", Path(image.source))
    else:
        half = (slices[1] - slices[0]) // 2
        all_of = np.arange(len(mask))
        near = slices[np.abs(all_of[:, None] - slices).argmin(axis=1)]
        filled = np.where((np.abs(all_of - near) <= half)[:, None, None], drawn[near], False)
    return dice(filled, mask), float(filled.sum() / mask.sum() - 1)


SAME_ORGAN_DISTANCE = 0.06  # points so far from the exact surface, relative to the half axes, belong to another organ
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

    Normals are the gradient of the grey values by central differences; the mean of the triangles around a point, by
    their areas; or those of each triangle.
    """
    level, rows = (synthetic_abdomen.LIVER_HU + synthetic_abdomen.FAT_HU) / 2, []
    for blur in (0.0, 1.0):
        steps = blur * image.spacing_m.min() / image.spacing_m[::-1]
        grey = gaussian_filter(image.hu.astype(np.float32), steps)
        points, triangles, slopes = isosurface(grey, level, image.origin_m, image.spacing_m, normals=True)
        for source, places, normals in _sources(points, triangles, slopes):
            side, exact = liver_side(places)
            near = np.abs(side - 1) < SAME_ORGAN_DISTANCE
            cosines = np.abs(np.einsum("ij,ij->i", normals[near], exact[near]))
            angles = np.degrees(np.arccos(np.clip(cosines, 0, 1)))
            far = np.linalg.norm(places[near] - _onto(places[near]), axis=1)
            median, p95 = np.percentile(angles, [50, 95])
            rows.append((blur, source, int(near.sum()), median, p95, float(np.sqrt((far**2).mean()))))
    return SURFACE_NORMALS.frame(rows)


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


def liver_side(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return where points (n, 3) [m] lie: 1 on the exact liver's surface, below inside; and its unit normals there.

    The normals (n, 3) are those of the ellipsoid of the same shape through each point.
    """
    _, centre, axes, turn = synthetic_abdomen.SHAPES["liver"]
    x, y, z = (points - np.array(centre)).T
    along, up = np.cos(turn) * x + np.sin(turn) * z, np.cos(turn) * z - np.sin(turn) * x
    a, b, c = along / axes[0] ** 2, y / axes[1] ** 2, up / axes[2] ** 2
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
    """Compute the rows of segmented_scans.csv, and the MRI as it is and evened with what is found in each.

    ct, liver : the synthetic abdomen and its liver, (nz, ny, nx) bool
    Where nothing is found, dice is 0.
    """
    raw = synthetic_abdomen.mri_abdomen(spacing_m=ct.spacing_m.tolist())[0]
    rows, shown = [], []
    for scan, image in (("CT", ct), ("MRI", raw), ("MRI, evened", even_brightness(raw))):
        limits = (30, 120) if image.modality == "ct" else synthetic_abdomen.LIVER_SIGNALS
        try:
            found = segment(image, limits)
        except InputError:
            found = np.zeros(image.hu.shape, dtype=bool)
        volume = float(found.sum() / liver.sum() - 1)
        rows.append((scan, dice(found, liver), volume))
        if image.modality == "mri":
            shown.append((image, found))
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

    method : thresholds midway between usual grey values; the probability of a mixture that is fitted to the histogram;
    or the percentages of two neighbouring tissues. A voxel is of the tissue that fills most of it.
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
        found = classify(image.hu.astype(np.float32))
        for k, tissue in enumerate(ray_casting.TISSUES):
            within = truth.argmax(axis=0) == k
            error = float(np.sqrt(((found - truth)[k] ** 2).mean()))
            rows.append((method, tissue.name, float((found.argmax(axis=0) != k)[within].mean()), error))
    return TISSUE_CLASSES.frame(rows)


def shape_shares(spacing_m: Sequence[float]) -> dict[str, np.ndarray]:
    """Compute the share of each voxel, (nz, ny, nx), that each shape fills and no later one hides, by its name."""
    spacing = np.asarray(spacing_m, dtype=float)
    counts = np.floor(2 * synthetic_abdomen.HALF_M / spacing).astype(int)
    shares: dict[str, np.ndarray] = {}
    origin = -(counts - 1) / 2 * spacing
    for name, (_, centre, axes, turn) in synthetic_abdomen.SHAPES.items():
        fraction = synthetic_abdomen.voxel_fractions(origin, spacing, counts, centre, axes, turn)
        shares = {other: share * (1 - fraction) for other, share in shares.items()} | {name: fraction}
    return shares


def _shares(image: Image) -> np.ndarray:
    """Return the share of each tissue in each voxel, (k, nz, ny, nx); what no shape fills is a gap."""
    shares = shape_shares(image.spacing_m.tolist())
    truth = np.zeros((len(ray_casting.TISSUES), *image.hu.shape), dtype=np.float32)
    for name, hu in synthetic_abdomen.hu_of_shapes().items():
        truth[np.searchsorted(ray_casting.thresholds(), hu)] += shares[name]
    truth[0] += 1 - truth.sum(axis=0)
    return truth


STEP = 0.5  # of the smallest side of a voxel, between samples along a ray
OPAQUE = 0.99  # opacity at which rays of the pictures end


class Pictures(NamedTuple):
    """Material of the figure: ``cast``, pictures by caption (height, width, 3), and the share of samples ``taken``.

    mris : the MRI as it is and evened, each with the liver that is found (nz, ny, nx) and the true one
    """

    cast: dict[str, np.ndarray]
    taken: np.ndarray
    mris: list[tuple[Image, np.ndarray]]
    liver: np.ndarray


def measure(
    masks: Mapping[str, tuple[Image, np.ndarray]],
    settings: Imaging,
    progress: Callable = iter,
) -> tuple[dict[str, pd.DataFrame], Pictures]:
    """Measure the tables of the imaging part by name, and what to draw.

    masks : image and organ of each body; progress : wraps the list of tables
    """
    image, truth = synthetic_abdomen.abdomen(spacing_m=(settings.voxel_m,) * 3)
    found: dict[str, pd.DataFrame] = {}
    for name in progress(["mask_interpolation", "surface_normals", "tissue_classes", "segmented_scans", "compositing"]):
        if name == "mask_interpolation":
            parts = [mask_interpolation(body, *scan, settings.every) for body, scan in masks.items()]
            found[name] = pd.concat(parts, ignore_index=True)
        elif name == "surface_normals":
            found[name] = surface_normals(image)
        elif name == "tissue_classes":
            found[name] = tissue_classes(image)
        elif name == "segmented_scans":
            found[name], mris = segmented_scans(image, truth["liver"])
        else:
            rays = ray_casting.parallel_rays(image, ray_casting.front(), settings.pixels, STEP)
            found[name] = ray_casting.compositing(ray_casting.field_of(image), rays, ray_casting.likely(image))
    return found, Pictures(*_pictures(image, rays), mris, truth["liver"])


def _pictures(image: Image, rays: ray_casting.Rays) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Cast the pictures that are drawn: classes by threshold and by probability, both orders of compositing."""
    field, transfer = ray_casting.field_of(image), ray_casting.likely(image)
    sharp = ray_casting.transfer_of(ray_casting.GREY, ray_casting.by_threshold(ray_casting.GREY))
    back = ray_casting.cast(field, transfer, rays, back_to_front=True)
    front_first, samples = ray_casting.cast(field, transfer, rays, enough=OPAQUE)
    shape = rays.height, rays.width
    shown = {
        "classes by threshold": ray_casting.cast(field, sharp, rays)[0],
        "by probability, back to front": back[0],
        f"front to back, ends at {OPAQUE:g}": front_first,
    }
    pictures = {caption: ray_casting.on_white(found).reshape(*shape, 3) for caption, found in shown.items()}
    return pictures, (samples / np.maximum(back[1], 1)).reshape(shape)
