"""Ray casting of a scan (paper 3, chapter 2): tissues by threshold or probability, composited in both orders, timed."""

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import numba
import numpy as np
import pandas as pd

from palpate.benchmark.measuring import time_calls
from palpate.bodies.ct.image import Image
from palpate.table_declaration import Table

_ROUNDS, _BINS = 200, 1024
_SETTLED = 1e-4  # change of the means over the range of grey values at which the fit has converged


class Tissue(NamedTuple):
    """A class of voxels: its usual grey value [HU], its colour, and its opacity per millimetre."""

    name: str
    hu: float
    colour: tuple[float, float, float]
    per_mm: float


TISSUES = (
    Tissue("gap", -1000.0, (0.98, 0.85, 0.76), 0.0),
    Tissue("fat", -100.0, (0.98, 0.85, 0.76), 0.004),
    Tissue("soft tissue", 50.0, (0.66, 0.32, 0.26), 0.04),
    Tissue("bone", 400.0, (0.96, 0.95, 0.92), 0.6),
)
"""Paper 3's: gaps transparent, skin and fat light and transparent, muscle darker, bone grey-white."""


class Mixture(NamedTuple):
    """A sum of normal distributions: ``means``, rising, ``deviations`` and ``shares``, (k,) each."""

    means: np.ndarray
    deviations: np.ndarray
    shares: np.ndarray


class Transfer(NamedTuple):
    """Transfer function: colours (n, 3) and opacities ``per_mm`` (n,) of evenly spaced grey ``values`` (n,)."""

    values: np.ndarray
    colours: np.ndarray
    per_mm: np.ndarray


def fit_mixture(grey: np.ndarray, starts: Sequence[float]) -> Mixture:
    """Fit a mixture of normal distributions to grey values by expectation and maximisation, on their histogram.

    starts : means (k,) at the start (Dempster, Laird, Rubin, J. R. Stat. Soc. B 39(1), 1977)
    Trap: voxels that two tissues share have any value between; without a distribution that is even over the range, and
    takes them, they would widen the others.
    """
    counts, edges = np.histogram(grey, _BINS)
    values, weights = (edges[1:] + edges[:-1]) / 2, counts / counts.sum()
    width, span = edges[1] - edges[0], edges[-1] - edges[0]
    means = np.array(starts, dtype=float)
    deviations = np.full(len(means), float(np.diff(means).min() / 4))
    shares, mixed = np.full(len(means), 1 / (len(means) + 1)), 1 / (len(means) + 1)
    for _ in range(_ROUNDS):
        standardised = (values - means[:, None]) / deviations[:, None]
        densities = (shares / deviations)[:, None] * np.exp(-(standardised**2) / 2) / np.sqrt(2 * np.pi)
        memberships = densities / (densities.sum(axis=0) + mixed / span) * weights
        amounts = np.maximum(memberships.sum(axis=1), 1e-12)
        new_means = memberships @ values / amounts
        squares = (memberships * (values - new_means[:, None]) ** 2).sum(axis=1) / amounts
        settled = np.abs(new_means - means).max() <= _SETTLED * span
        means, deviations = new_means, np.maximum(np.sqrt(squares), width)
        shares, mixed = amounts, max(1 - float(amounts.sum()), 0.0)
        if settled:
            break
    order = np.argsort(means)
    return Mixture(means[order], deviations[order], shares[order] / shares.sum())


def probabilities(mixture: Mixture, values: np.ndarray) -> np.ndarray:
    """Compute the probabilities (k, …) of each class at grey values (…), by Bayes' rule; they sum to 1.

    Only the two classes whose means are beside a value count, and only the last class beyond all means. Trap: far from
    all means the widest class would win, so that a voxel that air and tissue share would be bone.
    """
    broadcast = (slice(None), *[None] * np.ndim(values))
    means, deviations = mixture.means[broadcast], mixture.deviations[broadcast]
    log_odds = np.log(np.maximum(mixture.shares, 1e-12))[broadcast] - ((values - means) / deviations) ** 2 / 2
    log_odds = log_odds - np.log(deviations)
    below = np.clip(np.searchsorted(mixture.means, values) - 1, 0, len(mixture.means) - 2)
    number = np.arange(len(mixture.means))[broadcast]
    beside = (number == below) & (values < mixture.means[-1]) | (number == below + 1) & (values > mixture.means[0])
    log_odds = np.where(beside, log_odds, -np.inf)
    odds = np.exp(log_odds - log_odds.max(axis=0))
    return odds / odds.sum(axis=0)


def thresholds() -> np.ndarray:
    """Return the grey values [HU] midway between neighbouring tissues."""
    usual = np.array([tissue.hu for tissue in TISSUES])
    return (usual[1:] + usual[:-1]) / 2


def by_threshold(values: np.ndarray) -> np.ndarray:
    """Return the fractions (k, …) of each class at grey values (…): 1 for the class by thresholds, 0 for all others."""
    number = np.searchsorted(thresholds(), values)
    return np.stack([number == k for k in range(len(TISSUES))]).astype(float)


def by_percentage(values: np.ndarray) -> np.ndarray:
    """Return the fractions (k, …) of tissues whose mixture has each grey value (…): of the two with the nearest values.

    Drebin, Carpenter, Hanrahan, "Volume rendering", SIGGRAPH 1988, without noise: linear between the usual values.
    """
    usual = [tissue.hu for tissue in TISSUES]
    return np.stack([np.interp(values, usual, one_class) for one_class in np.eye(len(usual))])


def transfer_of(values: np.ndarray, shares: np.ndarray) -> Transfer:
    """Return the transfer function of mixtures of tissues with fractions ``shares`` (k, n) at grey ``values`` (n,)."""
    opacities = np.array([tissue.per_mm for tissue in TISSUES])
    weights = shares * np.maximum(opacities, 1e-9)[:, None]
    colours = (weights / weights.sum(axis=0)).T @ np.array([tissue.colour for tissue in TISSUES])
    return Transfer(values, colours, opacities @ shares)


AMBIENT, DIFFUSE = 0.3, 0.65  # parts of the light from all sides, and from the viewer


_TURN, _RISE = np.radians(-28.0), np.radians(14.0)  # from the front towards the patient's right, and up


def front() -> np.ndarray:
    """Return the axes (3, 3) right, up and to the viewer of a view from the front, the right and above."""
    toward = np.array([np.sin(_TURN) * np.cos(_RISE), -np.cos(_TURN) * np.cos(_RISE), np.sin(_RISE)])
    right = np.cross([0.0, 0.0, 1.0], toward)
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(toward, right), toward])


class Rays(NamedTuple):
    """Parallel rays through an image, one a pixel, row by row from above.

    starts : (n, 3) first samples in voxels, z y x; step : (3,) from one sample to the next; counts : (n,) of samples
    step_m : distance of samples [m]; away : (3,) unit vector from the viewer, x y z
    height, width : of the picture in pixels
    """

    starts: np.ndarray
    step: np.ndarray
    counts: np.ndarray
    step_m: float
    away: np.ndarray
    height: int
    width: int


def field_of(image: Image) -> np.ndarray:
    """Return the grey values and their gradient along x, y and z [1/m] by central differences, (nz, ny, nx, 4).

    The image has to have at least two voxels along each axis.
    """
    grey = image.hu.astype(np.float32)
    slopes = np.gradient(grey, *image.spacing_m[::-1].astype(np.float32))
    return np.stack([grey, *slopes[::-1]], axis=-1)


def corners(image: Image) -> np.ndarray:
    """Return the corners of the grid, (8, 3) [m]."""
    return image.to_world(np.array(list(np.ndindex(2, 2, 2))) * (np.array(image.hu.shape) - 1))


def parallel_rays(image: Image, axes: np.ndarray, pixels: int, step: float) -> Rays:
    """Make parallel rays through the whole image, for a picture of ``pixels`` pixels across.

    axes : (3, 3), rows right, up and toward the viewer; step : between samples, in the smallest side of a voxel
    """
    in_view = corners(image) @ axes.T
    lowest, highest = in_view.min(axis=0), in_view.max(axis=0)
    pixel = float(highest[0] - lowest[0]) / pixels
    height = max(round(float(highest[1] - lowest[1]) / pixel), 1)
    right_m = lowest[0] + pixel * (np.arange(pixels) + 0.5)
    up_m = highest[1] - pixel * (np.arange(height) + 0.5)
    places = np.stack(np.broadcast_arrays(right_m, up_m[:, None], highest[2]), axis=-1).reshape(-1, 3)
    step_m = step * float(image.spacing_m.min())
    step_in_voxels = (-step_m * axes[2] / image.spacing_m)[::-1]
    starts, counts = _within(image.to_index(places @ axes), step_in_voxels, np.array(image.hu.shape) - 1)
    return Rays(starts, step_in_voxels, counts, step_m, -axes[2], height, pixels)


def _within(starts: np.ndarray, step: np.ndarray, largest: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the first sample (n, 3) of each ray inside the grid, and how many there are (n,), 0 for a ray beside it.

    starts : (n, 3) in voxels, on a plane of samples that all rays share; step : (3,); largest : (3,) last indices
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        at_first_face, at_last_face = -starts / step, (largest - starts) / step
    parallel = step == 0
    inside = ((starts >= 0) & (starts <= largest)) | ~parallel
    enter = np.where(parallel, -np.inf, np.minimum(at_first_face, at_last_face)).max(axis=1)
    leave = np.where(parallel, np.inf, np.maximum(at_first_face, at_last_face)).min(axis=1)
    first_sample = np.ceil(enter - 1e-9)
    counts = np.where(inside.all(axis=1), np.maximum(np.floor(leave + 1e-9) - first_sample + 1, 0), 0).astype(np.int64)
    return starts + np.where(counts > 0, first_sample, 0.0)[:, None] * step, counts


def cast(
    voxels: np.ndarray, transfer: Transfer, rays: Rays, back_to_front: bool = False, enough: float = 1.0
) -> tuple[np.ndarray, np.ndarray]:
    """Cast rays; return colour times opacity and opacity (n, 4), and the number of samples (n,) of each ray.

    voxels : of ``field_of``
    enough : opacity at which a ray from front to back ends; at 1 none does. It changes no colour by more than
        ``1 − enough``, the transparency that is left.
    Samples are trilinear, classified by ``transfer`` after interpolation, and lit by a lamp at the viewer. The opacity
    a of a millimetre becomes 1 − (1 − a)^step of a step, so that the picture hardly depends on the step.
    """
    opacity = 1 - (1 - transfer.per_mm) ** (1e3 * rays.step_m)
    table = np.column_stack([transfer.colours, opacity])
    scale = transfer.values[0], transfer.values[1] - transfer.values[0]
    return _cast(voxels, table, scale, rays.starts, rays.step, rays.counts, rays.away, back_to_front, enough)


@numba.njit(cache=True)
def _cast(voxels, table, scale, starts, step, counts, viewer, back_to_front, enough):
    """Composite the samples of each ray, as ``cast``.

    table : (m, 4) colour and opacity of grey values, whose first value and spacing are ``scale``; viewer : (3,) the
    direction away from it, as in ``Rays``
    """
    colours, samples = np.zeros((len(starts), 4)), np.zeros(len(starts), dtype=np.int64)
    colour = np.empty(4)
    for ray in range(len(starts)):
        total = colours[ray]
        for number in range(counts[ray]):
            k = counts[ray] - 1 - number if back_to_front else number
            samples[ray] += 1
            z, y, x = starts[ray, 0] + k * step[0], starts[ray, 1] + k * step[1], starts[ray, 2] + k * step[2]
            _look_up(_interpolate(voxels, z, y, x, 0), table, scale, colour)
            opacity = colour[3]
            if opacity == 0:
                continue
            light = AMBIENT + DIFFUSE * _facing(voxels, z, y, x, viewer)
            if back_to_front:
                for c in range(3):
                    total[c] = light * colour[c] * opacity + (1 - opacity) * total[c]
                total[3] = opacity + (1 - opacity) * total[3]
            else:
                transparency = 1 - total[3]
                for c in range(3):
                    total[c] += transparency * opacity * light * colour[c]
                total[3] += transparency * opacity
                if total[3] >= enough and enough < 1:
                    break
    return colours, samples


@numba.njit(cache=True)
def _interpolate(voxels, z, y, x, c):
    """Interpolate component ``c`` of the field trilinearly at z, y, x in voxels, which may be on its border."""
    nz, ny, nx, _ = voxels.shape
    k, j, i = min(max(int(z), 0), nz - 2), min(max(int(y), 0), ny - 2), min(max(int(x), 0), nx - 2)
    w, v, u = z - k, y - j, x - i
    lower = (1 - v) * ((1 - u) * voxels[k, j, i, c] + u * voxels[k, j, i + 1, c])
    lower += v * ((1 - u) * voxels[k, j + 1, i, c] + u * voxels[k, j + 1, i + 1, c])
    upper = (1 - v) * ((1 - u) * voxels[k + 1, j, i, c] + u * voxels[k + 1, j, i + 1, c])
    upper += v * ((1 - u) * voxels[k + 1, j + 1, i, c] + u * voxels[k + 1, j + 1, i + 1, c])
    return (1 - w) * lower + w * upper


@numba.njit(cache=True)
def _look_up(grey, table, scale, colour):
    """Write the colour and opacity (4,) of a grey value, interpolated in ``table``, to ``colour``."""
    place = min(max((grey - scale[0]) / scale[1], 0.0), len(table) - 1.0)
    at = min(int(place), len(table) - 2)
    share = place - at
    for c in range(4):
        colour[c] = (1 - share) * table[at, c] + share * table[at + 1, c]


@numba.njit(cache=True)
def _facing(voxels, z, y, x, viewer):
    """Return the magnitude of the cosine between grey-value gradient and view; 1 where there is no gradient."""
    along, square = 0.0, 0.0
    for c in range(3):
        slope = _interpolate(voxels, z, y, x, c + 1)
        along += slope * viewer[c]
        square += slope * slope
    return abs(along) / np.sqrt(square) if square > 0 else 1.0


BACK, FRONT = "back to front", "front to back"
ORDERS = ((BACK, 1.0), (FRONT, 1.0), (FRONT, 0.99))
"""Order of compositing, and the opacity at which a ray ends; at 1 no ray does."""
GREY = np.arange(-1100.0, 1501.0, 4.0)  # grey values [HU] at which transfer functions are tabulated
TRANSLUCENT, SOLID = "translucent", "solid"  # tissues as they are, and ten times as dense

COMPOSITING = Table(
    "compositing",
    "Pictures composited in both orders: samples a ray takes, time, and difference from back to front.",
    """
    looks order enough: opacities, order of compositing, and the opacity at which a ray ends
    samples median_s: samples a ray, and time of a picture [s]
    difference: largest difference of a colour, 0 to 1, from back to front
    """,
)


def compositing(voxels: np.ndarray, rays: Rays, transfer: Transfer) -> pd.DataFrame:
    """Compute the rows of compositing.csv, with the opacities of ``transfer`` and of tissues ten times as dense."""
    rows = []
    dense = transfer._replace(per_mm=1 - (1 - transfer.per_mm) ** 10.0)
    for looks, shown in ((TRANSLUCENT, transfer), (SOLID, dense)):
        calls = [
            partial(cast, voxels, shown, rays, back_to_front=order == BACK, enough=enough) for order, enough in ORDERS
        ]
        pictures = [call() for call in calls]
        exact = on_white(pictures[0][0])
        timed = time_calls(calls, 5).seconds  # each takes some tenths of a second
        for (order, enough), (colours, samples), seconds in zip(ORDERS, pictures, timed, strict=True):
            difference = float(abs(on_white(colours) - exact).max())
            rows.append((looks, order, enough, float(samples.mean()), float(np.median(seconds)), difference))
    return COMPOSITING.frame(rows)


def back_and_early(compositing: pd.DataFrame, looks: str) -> tuple[pd.Series, pd.Series]:
    """Return the rows of compositing.csv back to front, and of rays that end at 99 % opacity, or the nearest to it."""
    rows = compositing[compositing["looks"] == looks]
    early_rows = rows[(rows["order"] == FRONT) & (rows["enough"] < 1)].sort_values("enough")
    return rows[rows["order"] == BACK].iloc[0], early_rows.iloc[0]


def on_white(colours: np.ndarray) -> np.ndarray:
    """Put colours times opacity, and opacity, (n, 4), on white: (n, 3), 0 to 1."""
    return colours[:, :3] + (1 - colours[:, 3:])


def likely(image: Image) -> Transfer:
    """Return the looks of a CT's grey values by the probability of each tissue, fitted to its histogram."""
    mixture = fit_mixture(image.hu, [tissue.hu for tissue in TISSUES])
    return transfer_of(GREY, probabilities(mixture, GREY))
