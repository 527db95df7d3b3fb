"""Materials of a body: one, or several in regions of it."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

LAWS = ("corotational", "stable_neo_hookean", "neo_hookean", "st_venant_kirchhoff")
"""The laws between deformation and energy that a body may have; a law of the user's own is the path of its file."""


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
    """

    materials: Sequence[Material]
    region: np.ndarray

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
        return np.array([each.young_pa for each in self.materials])[self.region]

    @cached_property
    def shear_pa(self) -> np.ndarray:
        """Second Lamé constant μ of each element, (n_elements,) [Pa]."""
        return np.array([each.shear_pa for each in self.materials])[self.region]

    @cached_property
    def lame_pa(self) -> np.ndarray:
        """First Lamé constant λ of each element, (n_elements,) [Pa]."""
        return np.array([each.lame_pa for each in self.materials])[self.region]

    @cached_property
    def density_kg_m3(self) -> np.ndarray:
        """Density of each element, (n_elements,) [kg/m³]."""
        return np.array([each.density_kg_m3 for each in self.materials])[self.region]


def uniform(material: Material, count: int) -> Tissue:
    """Return the tissue of ``count`` elements of one material."""
    return Tissue((material,), np.zeros(count, dtype=np.int64))


def joined(parts: Sequence[Tissue]) -> Tissue:
    """Join the tissues of several meshes, whose elements follow each other; materials that are equal become one."""
    materials = list(dict.fromkeys(each for part in parts for each in part.materials))
    numbers = [np.array([materials.index(each) for each in part.materials])[part.region] for part in parts]
    return Tissue(tuple(materials), np.concatenate(numbers))
