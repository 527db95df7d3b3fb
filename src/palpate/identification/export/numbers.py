"""What was identified and goes to an engine, and the damping that stands for relaxation where an engine has none."""

from dataclasses import dataclass

import numpy as np

from palpate.bodies.material import Series

FREQUENCY_HZ = 1.0
"""At which a damping time stands for relaxation: that of a hand that palpates."""
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
        """Time [s] by which strain rates add to strains so that as much is lost in a swing at FREQUENCY_HZ.

        It is the loss modulus over the storage modulus and the angular frequency (Simo and Hughes 1998, section 10.2).
        """
        if self.relaxation is None:
            return USUAL_DAMPING_S
        times, ratios = np.array(self.relaxation.times_s, dtype=float), self.relaxation.ratios
        swing = (2.0 * np.pi * FREQUENCY_HZ * times) ** 2
        return float((ratios * times / (1.0 + swing)).sum() / (1.0 + (ratios * swing / (1.0 + swing)).sum()))

    @property
    def damping_said(self) -> str:
        """Say where the damping is from."""
        if self.relaxation is None:
            return f"relaxation was not identified; {USUAL_DAMPING_S:g} s is palpate's usual damping"
        return f"loses what the identified relaxation loses at {FREQUENCY_HZ:g} Hz, and does not creep"
