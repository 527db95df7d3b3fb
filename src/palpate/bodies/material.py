"""Materials of a body, one or several in regions of it, and the relaxation of a material by a Prony series."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

LAWS = ("corotational", "stable_neo_hookean", "neo_hookean", "st_venant_kirchhoff")
"""The laws between deformation and energy that a body may have by their name alone; see ``kind_of``."""
EXPONENTIAL = "exponential"
"""The law that is named with its stiffening, as "exponential(8)"; a law of the user's own is the path of its file."""
NAMED = (*LAWS, f"{EXPONENTIAL}(8)")
"""All laws as a body may name them, the last with a stiffening for example."""
PATTERN_EXPONENTIAL = rf"{EXPONENTIAL}\([0-9]+(\.[0-9]+)?(e-?[0-9]+)?\)"


def exponential(stiffening: float) -> str:
    """Return the name of the exponential law with this stiffening, to six digits."""
    return f"{EXPONENTIAL}({stiffening:.6g})".replace("e+", "e")


def kind_of(law: str) -> str:
    """Return one of LAWS, EXPONENTIAL, or nothing for the path of a file."""
    return law if law in LAWS else EXPONENTIAL if re.fullmatch(PATTERN_EXPONENTIAL, law) else ""


def stiffening_of(law: str) -> float | None:
    """Return the stiffening of an exponential law by its name, None of others."""
    return float(law[len(EXPONENTIAL) + 1 : -1]) if kind_of(law) == EXPONENTIAL else None


@dataclass(frozen=True)
class Material:
    """Isotropic constants: Young's modulus [Pa] and Poisson's ratio at rest, density [kg/m³]; and the law beyond."""

    young_pa: float
    poisson: float
    density_kg_m3: float
    law: str = LAWS[0]

    @property
    def shear_pa(self) -> float:
        """Second Lamé constant μ [Pa]."""
        return self.young_pa / (2 * (1 + self.poisson))

    @property
    def lame_pa(self) -> float:
        """First Lamé constant λ [Pa]."""
        return self.young_pa * self.poisson / ((1 + self.poisson) * (1 - 2 * self.poisson))


@dataclass(frozen=True, eq=False)
class Tissue:
    """The materials of the elements of one mesh; all have the same law.

    materials : those that occur, the body's own first; region : (n_elements,) the number of each element's in them
    share : (n_elements,) how much of each element is tissue, None for all of all; moduli and densities are means
    """

    materials: Sequence[Material]
    region: np.ndarray
    share: np.ndarray | None = None

    @property
    def law(self) -> str:
        return self.materials[0].law

    @property
    def is_one_stiffness(self) -> bool:
        """True if all materials deform alike; densities may differ."""
        return len({(each.young_pa, each.poisson) for each in self.materials}) == 1

    @cached_property
    def young_pa(self) -> np.ndarray:
        """Young's modulus of each element, (n_elements,) [Pa]."""
        return self._means([each.young_pa for each in self.materials])

    @cached_property
    def shear_pa(self) -> np.ndarray:
        """Second Lamé constant μ of each element, (n_elements,) [Pa]."""
        return self._means([each.shear_pa for each in self.materials])

    @cached_property
    def lame_pa(self) -> np.ndarray:
        """First Lamé constant λ of each element, (n_elements,) [Pa]."""
        return self._means([each.lame_pa for each in self.materials])

    @cached_property
    def density_kg_m3(self) -> np.ndarray:
        """Density of each element, (n_elements,) [kg/m³]."""
        return self._means([each.density_kg_m3 for each in self.materials])

    def _means(self, values: Sequence[float]) -> np.ndarray:
        of_each = np.array(values)[self.region]
        return of_each if self.share is None else self.share * of_each


def uniform(material: Material, count: int) -> Tissue:
    """Return the tissue of ``count`` elements of one material."""
    return Tissue((material,), np.zeros(count, dtype=np.int64))


def joined(parts: Sequence[Tissue]) -> Tissue:
    """Join the tissues of several meshes, whose elements follow each other; materials that are equal become one."""
    materials = list(dict.fromkeys(each for part in parts for each in part.materials))
    numbers = [np.array([materials.index(each) for each in part.materials])[part.region] for part in parts]
    return Tissue(tuple(materials), np.concatenate(numbers))


LARGEST_SUM = 0.99
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

    def factors(self, h: np.ndarray | float) -> tuple[np.ndarray, np.ndarray]:
        """Return factors a and b, (…, k), of steps ``h`` (…) [s]: the strain of a branch becomes a · itself + b · Δe.

        That is the solution of ds/dt = de/dt − s/τ where the strain e changes evenly by Δe: a = exp(−h/τ) and
        b = (1 − a) τ/h (Taylor, Pister and Goudreau 1970). Both are 1 for h = 0, and a ≤ b ≤ 1.
        """
        spans = np.asarray(h)[..., None] / np.array(self.times_s, dtype=float)
        nonzero = np.maximum(spans, 1e-300)
        return np.exp(-spans), np.where(spans > 0.0, -np.expm1(-nonzero) / nonzero, 1.0)


def prony_fault(series: "Series | Any") -> str:
    """Describe what is wrong with a series or a block ``prony``, beginning with the key; empty if nothing is."""
    shares, times = series.shares, series.times_s
    if len(shares) != len(times) or not len(shares):
        return f"shares has {len(shares)} numbers and times_s {len(times)}; give one time for each share"
    if bad := [share for share in shares if not share > 0.0]:
        return f"shares has {bad[0]:g}; give numbers above 0"
    if not math.fsum(shares) <= LARGEST_SUM:
        return (
            f"shares has the sum {math.fsum(shares):.4g}, of which {LARGEST_SUM:g} is the most: what is left of 1 is "
            "the modulus that does not relax; give smaller shares of the instantaneous modulus"
        )
    if bad := [time for time in times if not LEAST_S <= time < math.inf]:
        return f"times_s has {bad[0]:g}; give times in seconds, of {LEAST_S:g} at least"
    return ""
