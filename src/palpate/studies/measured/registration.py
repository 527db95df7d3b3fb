"""From the frame of a record to that of the body: the rigid motion that fits markers to their places at rest."""

from dataclasses import dataclass

import numpy as np

from palpate.errors import InputError

MISFIT = 0.2
"""Misfit, as a share of the spread of the markers, above which they are taken for others."""


@dataclass(frozen=True, eq=False)
class Registration:
    """A rigid motion x → rotation x + shift, (3, 3) and (3,) [m]; ``misfit_m``: RMS distance that is left [m]."""

    rotation: np.ndarray
    shift: np.ndarray
    misfit_m: float

    def apply(self, places: np.ndarray) -> np.ndarray:
        """Move ``places`` (…, 3) [m] into the body's frame."""
        return places @ self.rotation.T + self.shift


def register(seen: np.ndarray, rest: np.ndarray, place: str) -> Registration:
    """Fit the markers ``seen`` (m, 3) [m] to their places at ``rest`` (m, 3) [m] in the body's frame (Kabsch 1976).

    Raises InputError, naming ``place``, for fewer than three markers or markers on one line, and if they do not fit:
    other units, a left-handed frame, or markers that are confused.
    """
    seen_middle, rest_middle = seen.mean(axis=0), rest.mean(axis=0)
    spread = np.linalg.svd(rest - rest_middle, compute_uv=False)
    if len(rest) < 3 or not spread[1] > 1e-3 * spread[0]:
        raise InputError(f"{place} needs three markers that are not on one line, to find the body's frame; add one.")
    left, _, right = np.linalg.svd((rest - rest_middle).T @ (seen - seen_middle))
    rotation = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
    shift = rest_middle - rotation @ seen_middle
    off = np.linalg.norm(seen @ rotation.T + shift - rest, axis=1)
    misfit, size = float(np.sqrt(np.mean(off**2))), float(np.linalg.norm(rest - rest_middle, axis=1).mean())
    if not misfit <= MISFIT * size:
        raise InputError(
            f"{place}: the markers before the release are {misfit:.3g} m (RMS) from their places at rest, which are "
            f"{size:.3g} m apart; see whether both are in metres, in right-handed frames, and in the same order."
        )
    return Registration(rotation, shift, misfit)
