"""Ray casting of a scan, composited front to back or back to front (paper 3, chapter 2)."""

from typing import NamedTuple

import numba
import numpy as np

from palpate.bodies.ct.image import Image
from palpate.studies.ct.tissue_classes import Transfer

AMBIENT, DIFFUSE = 0.3, 0.65
"""Shares of light from all sides, and from where the viewer is."""


_TURN, _RISE = np.radians(-28.0), np.radians(14.0)  # from the front towards the patient's right, and up


def front() -> np.ndarray:
    """Return the axes of a view from the front, slightly from the right and above: right, up, to the viewer."""
    toward = np.array([np.sin(_TURN) * np.cos(_RISE), -np.cos(_TURN) * np.cos(_RISE), np.sin(_RISE)])
    right = np.cross([0.0, 0.0, 1.0], toward)
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(toward, right), toward])


class Field(NamedTuple):
    """Samples for rays: ``voxels`` (nz, ny, nx, 4), grey values and their gradient [1/m] along x, y and z.

    Two voxels along each axis at least.
    """

    voxels: np.ndarray
    image: Image


class Rays(NamedTuple):
    """Parallel rays in voxels: ``starts`` (n, 3) in z y x, nearest first, ``step`` (3,), ``counts`` (n,) of samples.

    step_m : distance of samples [m]; away : (3,) unit vector from the viewer, x y z
    height, width : pixels, row by row from above
    """

    starts: np.ndarray
    step: np.ndarray
    counts: np.ndarray
    step_m: float
    away: np.ndarray
    height: int
    width: int


def field_of(image: Image) -> Field:
    """Compute central differences of the grey values in every voxel, for shading."""
    grey = image.hu.astype(np.float32)
    slopes = np.gradient(grey, *image.spacing_m[::-1].astype(np.float32))
    return Field(np.stack([grey, *slopes[::-1]], axis=-1), image)


def parallel_rays(image: Image, axes: np.ndarray, pixels: int, step: float) -> Rays:
    """Make rays through the whole grid, ``pixels`` across.

    axes : (3, 3), rows right, up and toward the viewer; step : between samples, in the smallest side of a voxel
    """
    last = np.array(image.hu.shape) - 1
    corners = image.to_world(np.array(list(np.ndindex(2, 2, 2))) * last) @ axes.T
    low, high = corners.min(axis=0), corners.max(axis=0)
    pixel = float(high[0] - low[0]) / pixels
    height = max(round(float(high[1] - low[1]) / pixel), 1)
    across = low[0] + pixel * (np.arange(pixels) + 0.5)
    upward = high[1] - pixel * (np.arange(height) + 0.5)
    seen = np.stack(np.broadcast_arrays(across, upward[:, None], high[2]), axis=-1).reshape(-1, 3)
    starts = image.to_index(seen @ axes)
    step_m = step * float(image.spacing_m.min())
    move = (-step_m * axes[2] / image.spacing_m)[::-1]
    return _within(Rays(starts, move, np.empty(0, dtype=np.int64), step_m, -axes[2], height, pixels), last)


def _within(rays: Rays, last: np.ndarray) -> Rays:
    """Let each ray begin where it enters the grid, on the same planes of samples for all, and end where it leaves."""
    with np.errstate(divide="ignore", invalid="ignore"):
        one, other = -rays.starts / rays.step, (last - rays.starts) / rays.step
    still = rays.step == 0
    inside = ((rays.starts >= 0) & (rays.starts <= last)) | ~still
    enter = np.where(still, -np.inf, np.minimum(one, other)).max(axis=1)
    leave = np.where(still, np.inf, np.maximum(one, other)).min(axis=1)
    first = np.ceil(enter - 1e-9)
    counts = np.where(inside.all(axis=1), np.maximum(np.floor(leave + 1e-9) - first + 1, 0), 0).astype(np.int64)
    return rays._replace(starts=rays.starts + np.where(counts > 0, first, 0.0)[:, None] * rays.step, counts=counts)


def cast(
    field: Field, transfer: Transfer, rays: Rays, back_to_front: bool = False, enough: float = 1.0
) -> tuple[np.ndarray, np.ndarray]:
    """Cast rays: colour times opacity, and opacity, (n, 4), and how many samples each ray took, (n,).

    enough : opacity at which a ray ends, front to back; with 1 none does. What lies behind would then be seen at
        ``1 − enough`` at most, which bounds the difference of any colour.
    Samples are trilinear, classified by ``transfer`` after interpolation, and lit by a lamp at the viewer. Opacity per
    millimetre becomes that of a step, 1 − (1 − a)^step, so that the picture hardly depends on the step.
    """
    opacity = 1 - (1 - transfer.per_mm) ** (1e3 * rays.step_m)
    look = np.column_stack([transfer.colours, opacity])
    where = transfer.values[0], transfer.values[1] - transfer.values[0]
    return _cast(field.voxels, look, where, rays.starts, rays.step, rays.counts, rays.away, back_to_front, enough)


@numba.njit(cache=True)
def _cast(voxels, look, where, starts, step, counts, away, back_to_front, enough):
    found, taken = np.zeros((len(starts), 4)), np.zeros(len(starts), dtype=np.int64)
    lit = np.empty(4)
    for ray in range(len(starts)):
        total = found[ray]
        for number in range(counts[ray]):
            at = counts[ray] - 1 - number if back_to_front else number
            taken[ray] += 1
            z, y, x = starts[ray, 0] + at * step[0], starts[ray, 1] + at * step[1], starts[ray, 2] + at * step[2]
            _look_up(_interpolate(voxels, z, y, x, 0), look, where, lit)
            share = lit[3]
            if share == 0:
                continue
            light = AMBIENT + DIFFUSE * _facing(voxels, z, y, x, away)
            if back_to_front:
                for c in range(3):
                    total[c] = light * lit[c] * share + (1 - share) * total[c]
                total[3] = share + (1 - share) * total[3]
            else:
                left = 1 - total[3]
                for c in range(3):
                    total[c] += left * share * light * lit[c]
                total[3] += left * share
                if total[3] >= enough and enough < 1:
                    break
    return found, taken


@numba.njit(cache=True)
def _interpolate(voxels, z, y, x, c):
    """Interpolate value ``c`` of the field trilinearly at a place in voxels, which may lie on its border."""
    nz, ny, nx, _ = voxels.shape
    k, j, i = min(max(int(z), 0), nz - 2), min(max(int(y), 0), ny - 2), min(max(int(x), 0), nx - 2)
    w, v, u = z - k, y - j, x - i
    near = (1 - v) * ((1 - u) * voxels[k, j, i, c] + u * voxels[k, j, i + 1, c])
    near += v * ((1 - u) * voxels[k, j + 1, i, c] + u * voxels[k, j + 1, i + 1, c])
    far = (1 - v) * ((1 - u) * voxels[k + 1, j, i, c] + u * voxels[k + 1, j, i + 1, c])
    far += v * ((1 - u) * voxels[k + 1, j + 1, i, c] + u * voxels[k + 1, j + 1, i + 1, c])
    return (1 - w) * near + w * far


@numba.njit(cache=True)
def _look_up(grey, look, where, lit):
    """Look up the colour and the opacity of a grey value."""
    place = min(max((grey - where[0]) / where[1], 0.0), len(look) - 1.0)
    at = min(int(place), len(look) - 2)
    share = place - at
    for c in range(4):
        lit[c] = (1 - share) * look[at, c] + share * look[at + 1, c]


@numba.njit(cache=True)
def _facing(voxels, z, y, x, away):
    """Return the cosine between the gradient and the viewer; 1 where there is no gradient."""
    along, square = 0.0, 0.0
    for c in range(3):
        slope = _interpolate(voxels, z, y, x, c + 1)
        along += slope * away[c]
        square += slope * slope
    return abs(along) / np.sqrt(square) if square > 0 else 1.0
