"""Synthetic abdomen whose liver is known exactly, for users without a CT."""

from collections.abc import Mapping, Sequence

import numpy as np

from palpate.bodies.ct.image import AIR_HU, Image
from palpate.bodies.ct.masses import density

SEED = 1
SPACING_M = (0.002, 0.002, 0.003)
LIVER_HU, FAT_HU, NOISE_HU = 60, -100, 12
# half the sides of the scanned box [m]; as in a real scan, the body continues above and below
HALF_M = np.array([0.17, 0.125, 0.1])
# samples along a voxel's side where a border cuts it
SAMPLES = 5
# Drawn one over the other: CT number [HU], centre and half axes [m] (inf: a cylinder), rotation about y [rad]. The
# liver lies in fat, as a real one does, so that no threshold of the liver alone is midway to its neighbourhood.
SHAPES = {
    "skin": (FAT_HU, (0, 0, 0), (0.16, 0.115, np.inf), 0),
    "wall": (55, (0, 0, 0), (0.147, 0.102, np.inf), 0),
    "cavity": (FAT_HU, (0, 0, 0), (0.139, 0.094, np.inf), 0),
    "spine": (400, (0, 0.065, 0), (0.021, 0.019, np.inf), 0),
    "right kidney": (35, (-0.06, 0.055, -0.055), (0.026, 0.022, 0.04), 0.15),
    "left kidney": (35, (0.06, 0.055, -0.03), (0.026, 0.022, 0.04), -0.15),
    "stomach air": (-950, (0.085, -0.03, 0.035), (0.025, 0.03, 0.03), 0),
    "liver": (LIVER_HU, (-0.045, -0.015, 0.02), (0.085, 0.06, 0.05), 0.35),
}
# The same in an MRI weighted by T1, of no unit: fat is bright, muscle and kidneys are dark. The noise is that of each
# of the two channels, the slope that of the logarithm of the brightness across half the sides.
_SIGNALS = {
    "skin": 800, "wall": 300, "cavity": 800, "spine": 450, "right kidney": 320, "left kidney": 320, "stomach air": 0,
    "liver": 500,
}  # fmt: skip
LIVER_SIGNALS = (400, 600)
"""Range of grey values in the MRI, once its brightness is even, that only the liver and the spine have."""
MRI_NOISE, MRI_SLOPE = 25, (0.6, 0.0, 0.3)


LABELS = {1: "liver", 2: "lesion"}
"""Labels of the truth. The lesion has the liver's grey value, as many have without contrast agent."""
LESION = ((-0.045, -0.047, 0.02), (0.018, 0.018, 0.018), 0.0)
"""Centre and half axes [m] of the lesion, and its rotation: a ball a centimetre below the liver's front."""


def abdomen(spacing_m: Sequence[float] = SPACING_M) -> tuple[Image, dict]:
    """Build a CT of ellipsoids with noise and partial volume, and the ground truth of its liver.

    spacing_m : (3,) [m] along x, y and z
    The truth: "liver", the voxels (nz, ny, nx) of which the liver fills at least half; "labels", LABELS of the voxels
    (nz, ny, nx), 0 elsewhere; "volume_m3" and "mass_kg", of the exact ellipsoid and its density.
    """
    origin, hu, truth = _draw({name: shape[0] for name, shape in SHAPES.items()}, AIR_HU, spacing_m)
    truth["mass_kg"] = truth["volume_m3"] * float(density(LIVER_HU))
    hu += np.random.default_rng(SEED).normal(0.0, NOISE_HU, hu.shape)
    hu = np.maximum(np.rint(hu), AIR_HU).astype(np.int16)
    return Image(hu, origin, np.asarray(spacing_m, dtype=float), "the synthetic abdomen"), truth


def mri_abdomen(spacing_m: Sequence[float] = SPACING_M) -> tuple[Image, dict]:
    """Build an MRI of the same ellipsoids, with Rician noise and uneven brightness, and the truth without a mass.

    Brightness grows by MRI_SLOPE, a logarithm, from the middle to the patient's left and to the head.
    """
    origin, grey, truth = _draw(_SIGNALS, 0, spacing_m)
    spacing, random = np.asarray(spacing_m, dtype=float), np.random.default_rng(SEED)
    x, y, z = (
        slope * (o + s * np.arange(n)) / half
        for slope, o, s, n, half in zip(MRI_SLOPE, origin, spacing, grey.shape[::-1], HALF_M, strict=True)
    )
    grey *= np.exp(x + y[:, None] + z[:, None, None])
    channels = random.normal(0.0, MRI_NOISE, (2, *grey.shape))
    grey = np.hypot(grey + channels[0], channels[1])
    return Image(np.rint(grey).astype(np.int16), origin, spacing, "the synthetic MRI", modality="mri"), truth


def _draw(
    values: Mapping[str, float], outside: float, spacing_m: Sequence[float]
) -> tuple[np.ndarray, np.ndarray, dict]:
    """Draw the shapes with their grey values by name: origin (3,) [m], grey values (nz, ny, nx), and the truth."""
    origin, fractions = shape_fractions(spacing_m)
    grey = np.full(fractions["liver"].shape, outside, dtype=np.float32)
    for name, fraction in fractions.items():
        grey += fraction * (values[name] - grey)
    liver = fractions["liver"] >= 0.5
    lesion = voxel_fractions(origin, np.asarray(spacing_m, dtype=float), grey.shape[::-1], *LESION) >= 0.5
    volume = 4 / 3 * np.pi * float(np.prod(SHAPES["liver"][2]))
    return origin, grey, {"liver": liver, "labels": liver.astype(np.int16) + lesion, "volume_m3": volume}


def shape_fractions(spacing_m: Sequence[float]) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return the origin (3,) [m] of the voxels, and what part of each, (nz, ny, nx), is in each shape, by its name."""
    spacing = np.asarray(spacing_m, dtype=float)
    counts = np.floor(2 * HALF_M / spacing).astype(int)
    origin = -(counts - 1) / 2 * spacing
    return origin, {name: voxel_fractions(origin, spacing, counts, *shape[1:]) for name, shape in SHAPES.items()}


def voxel_fractions(
    origin: np.ndarray,
    spacing: np.ndarray,
    counts: Sequence[int],
    centre: Sequence[float],
    axes: Sequence[float],
    turn: float,
) -> np.ndarray:
    """Compute the fraction of each voxel inside an ellipsoid, (nz, ny, nx), 0 to 1."""
    x, y, z = (o + s * np.arange(n) - c for o, s, n, c in zip(origin, spacing, counts, centre, strict=True))
    center_radius = ellipsoid_radius(x, y[:, None], z[:, None, None], axes, turn)
    # a border that cuts a voxel is within half the voxel's diagonal of its middle
    reach = np.linalg.norm(spacing) / 2 / min(axes)
    fraction = (center_radius < 1).astype(np.float32)
    k, j, i = np.nonzero(np.abs(center_radius - 1) <= reach)
    steps = (np.arange(SAMPLES) + 0.5) / SAMPLES - 0.5
    dx, dy, dz = (s * g.ravel() for s, g in zip(spacing, np.meshgrid(steps, steps, steps), strict=True))
    inside = sum(
        (ellipsoid_radius(x[i] + a, y[j] + b, z[k] + c, axes, turn) < 1).astype(np.float32)
        for a, b, c in zip(dx, dy, dz, strict=True)
    )
    fraction[k, j, i] = inside / len(dx)
    return fraction


def ellipsoid_radius(x: np.ndarray, y: np.ndarray, z: np.ndarray, axes: Sequence[float], turn: float) -> np.ndarray:
    """Compute the distance from the centre in units of the half axes: 1 on the ellipsoid."""
    along, up = np.cos(turn) * x + np.sin(turn) * z, np.cos(turn) * z - np.sin(turn) * x
    return np.sqrt((along / axes[0]) ** 2 + (y / axes[1]) ** 2 + (up / axes[2]) ** 2)
