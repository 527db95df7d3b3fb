"""Identified numbers for export, and a level of a body whose modulus compensates for an engine's linear elements."""

from dataclasses import dataclass, replace

import numpy as np

from palpate.bodies.body import Body
from palpate.bodies.material import Material, Series
from palpate.identification.export.pressed_mesh import Stiffer

FREQUENCY_HZ = 1.0
"""Frequency of a palpating hand, at which damping dissipates as much as the identified relaxation."""
USUAL_DAMPING_S = 0.01
"""Stiffness-proportional damping of palpate's scenes, where no relaxation was identified."""


@dataclass(frozen=True)
class Numbers:
    """The tissue of a body named ``name``, at the rate of the presses that it was identified from.

    law : as palpate names it; relaxation : of the shear modulus, or None; loading_s : how long the presses took [s]
    """

    name: str
    young_pa: float
    poisson: float
    density_kg_m3: float
    law: str
    relaxation: Series | None = None
    loading_s: float = 0.0

    @property
    def settled_pa(self) -> float:
        """Young's modulus after relaxation [Pa], which a body of palpate with ``prony`` has."""
        if self.relaxation is None:
            return self.young_pa
        return self.young_pa / float(self.relaxation.modulus(self.loading_s))

    @property
    def damping_s(self) -> float:
        """Stiffness-proportional damping [s] that dissipates as much in a cycle at FREQUENCY_HZ as the relaxation does.

        It is the loss modulus over the storage modulus and the angular frequency (Simo and Hughes 1998, section 10.2).
        """
        if self.relaxation is None:
            return USUAL_DAMPING_S
        times, ratios = np.array(self.relaxation.times_s, dtype=float), self.relaxation.ratios
        swing = (2.0 * np.pi * FREQUENCY_HZ * times) ** 2
        return float((ratios * times / (1.0 + swing)).sum() / (1.0 + (ratios * swing / (1.0 + swing)).sum()))


@dataclass(frozen=True, eq=False)
class EngineMesh:
    """A level of ``body`` whose linear elements act ``stiffer`` under an engine's law."""

    body: Body
    level: int
    numbers: Numbers
    stiffer: Stiffer

    @property
    def young_pa(self) -> float:
        """Young's modulus [Pa] with which the mesh has the organ's forces."""
        return self.numbers.young_pa / self.stiffer.factor

    @property
    def comment(self) -> str:
        """The comment of every exported file: where its numbers are from, and what they lack."""
        poisson = self.numbers.poisson
        text = f"Identified: E = {self.numbers.young_pa:.6g} Pa, nu = {poisson:.4g}, law {self.numbers.law}. "
        text += f"E = {self.young_pa:.6g} Pa below: {self.stiffer.sentence}. "
        if self.stiffer.poisson < poisson:
            text += f"nu = {self.stiffer.poisson:g} below, as linear elements lock above. "
        damping = f"loses what the identified relaxation loses at {FREQUENCY_HZ:g} Hz, and does not creep"
        if self.numbers.relaxation is None:
            damping = f"relaxation was not identified; {USUAL_DAMPING_S:g} s is palpate's usual damping"
        return text + f"Damping: {damping}. SI units: m, kg, s, Pa."

    @property
    def corrected(self) -> Body:
        """The body with the constants that go to the engine."""
        material = Material(self.young_pa, self.stiffer.poisson, self.numbers.density_kg_m3, self.stiffer.law)
        return replace(self.body, material=material)
