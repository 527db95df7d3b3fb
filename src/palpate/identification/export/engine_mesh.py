"""What exported files are made from: a level of a body for an engine, the numbers, the modulus that compensates."""

from dataclasses import dataclass, replace

from palpate.bodies.body import Body
from palpate.bodies.material import Material
from palpate.identification.export.numbers import Numbers
from palpate.identification.export.pressed_mesh import Stiffer


@dataclass(frozen=True, eq=False)
class EngineMesh:
    """A level of ``body`` whose linear elements act ``stiffer`` under an engine's law."""

    body: Body
    level: int
    numbers: Numbers
    stiffer: Stiffer

    @property
    def young_pa(self) -> float:
        """Young's modulus [Pa] with which the mesh acts as the organ does."""
        return self.numbers.young_pa / self.stiffer.factor

    @property
    def comment(self) -> str:
        """What is said in every exported file."""
        poisson = self.numbers.poisson
        said = f"Identified: E = {self.numbers.young_pa:.6g} Pa, nu = {poisson:.4g}, law {self.numbers.law}. "
        said += f"E = {self.young_pa:.6g} Pa below: {self.stiffer.sentence}. "
        if self.stiffer.poisson < poisson:
            said += f"nu = {self.stiffer.poisson:g} below, as linear elements lock above. "
        return said + f"Damping: {self.numbers.damping_said}. SI units: m, kg, s, Pa."

    @property
    def corrected(self) -> Body:
        """The body with the constants that go to the engine."""
        material = Material(self.young_pa, self.stiffer.poisson, self.numbers.density_kg_m3, self.stiffer.law)
        return replace(self.body, material=material)
