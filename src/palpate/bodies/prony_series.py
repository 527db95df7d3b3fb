"""A Prony series: how the shear modulus of a material decays from its first value to its last one."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

MOST = 0.99
"""Largest sum of shares: at once the material is then a hundred times as stiff as at the end."""
LEAST_S = 1e-9
"""Shortest time of a branch [s]."""


@dataclass(frozen=True)
class Series:
    """G(t) = G₀ (1 − Σ gᵢ (1 − exp(−t/τᵢ))), the generalised Maxwell model (Simo and Hughes 1998, section 10.2).

    shares : gᵢ, of the instantaneous modulus G₀; times_s : τᵢ [s]

    The body's Young's modulus gives the modulus at the end, G∞ = G₀ (1 − Σ gᵢ), so that what it comes to rest in does
    not depend on the series.
    """

    shares: Sequence[float]
    times_s: Sequence[float]

    @property
    def ratios(self) -> np.ndarray:
        """The modulus of each branch relative to the one at the end, gᵢ / (1 − Σ gᵢ), (k,)."""
        return np.array(self.shares) / (1.0 - math.fsum(self.shares))

    def modulus(self, t: np.ndarray | float) -> np.ndarray:
        """Return G(t) / G∞ at the times ``t`` (…) [s] after a sudden strain, which is then held."""
        decays = np.exp(-np.asarray(t)[..., None] / np.array(self.times_s))
        return 1.0 + decays @ self.ratios

    def factors(self, h: float) -> tuple[np.ndarray, np.ndarray]:
        """Return (k,) factors a and b of a step of ``h`` [s]: the strain of a branch becomes a · itself + b · Δe.

        That is the solution of ds/dt = de/dt − s/τ where the strain e changes evenly by Δe: a = exp(−h/τ) and
        b = (1 − a) τ/h (Taylor, Pister and Goudreau 1970). Both are 1 for h = 0, and a ≤ b ≤ 1.
        """
        if h == 0.0:
            return np.ones(len(self.times_s)), np.ones(len(self.times_s))
        spans = h / np.array(self.times_s, dtype=float)
        return np.exp(-spans), -np.expm1(-spans) / spans


def fault(settings: dict) -> str:
    """Describe what is wrong with the block of a scene, beginning with the key; empty if nothing is."""
    shares, times = settings["shares"], settings["times_s"]
    if len(shares) != len(times) or not len(shares):
        return f"shares has {len(shares)} numbers and times_s {len(times)}; give one time for each share"
    if wrong := [share for share in shares if not share > 0.0]:
        return f"shares has {wrong[0]:g}; give numbers above 0"
    if not math.fsum(shares) <= MOST:
        return (
            f"shares has the sum {math.fsum(shares):.4g}, of which {MOST:g} is the most: what is left of 1 is the "
            "modulus that does not relax; give smaller shares of the instantaneous modulus"
        )
    if wrong := [time for time in times if not LEAST_S <= time < math.inf]:
        return f"times_s has {wrong[0]:g}; give times in seconds, of {LEAST_S:g} at least"
    return ""
