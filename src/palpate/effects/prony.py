"""Viscous stress of tissue: a Prony series on the part of finite elements' stress that changes their shape."""

import numpy as np

from palpate.bodies.material import Series, prony_fault
from palpate.bodies.particles import Particles
from palpate.effects.effect import Effect, Energy, Relaxation, StepBegin, StepEnd, Stiffness
from palpate.effects.linear_elements import LinearElements
from palpate.effects.one_pass import OnePass
from palpate.effects.prony_hessian import add_stiffness
from palpate.effects.prony_kernel import energy_and_force, strains
from palpate.errors import InputError

TWICE = np.array([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])
"""How often each of a strain's six entries occurs in its matrix."""


def make(particles: Particles, settings: dict, elastic: Effect | None) -> "Prony":
    """Make the branches of a series; InputError for a wrong one, and if the elastic effect is not finite elements.

    settings : ``shares`` of the instantaneous shear modulus, and ``times_s`` [s] in which they relax
    """
    if not isinstance(elastic, LinearElements):
        raise InputError(
            f"{particles.name}: prony acts on the stress of finite elements of a solid, and the elastic effect is "
            "another; choose corotational or another law, or leave prony out."
        )
    if wrong := prony_fault(settings):
        raise InputError(f"{particles.name}: prony.{wrong}.")
    return Prony(elastic, Series(settings["shares"], settings["times_s"]))


class Prony(OnePass, Energy, Stiffness, StepBegin, StepEnd, Relaxation):
    """Springs in series with dampers, beside the elastic law: Ψ = Σ μᵢ ‖e − qᵢ‖², dqᵢ/dt = (e − qᵢ)/τᵢ.

    e is the deviatoric stretch in the frame of the material (see prony_kernel), so a rotation changes nothing; qᵢ, in
    ``inner`` (m, k, 6), are the lengths of the dampers, and μᵢ is that of the elastic law at rest times the ratio of
    the branch. Under a corotational law the first response is that of a shear modulus larger by 1/(1 − Σ gᵢ), at any
    strain; the last one is that without the effect.

    **A step.** The strain changes evenly over it, for which the update of q is exact (Series.factors); so creep and
    relaxation are of second order in the step. The force at its end is the gradient of the energy
    Σ μᵢ bᵢ ‖e − rᵢ‖² with rᵢ = (1 − aᵢ/bᵢ) eₙ + aᵢ/bᵢ qᵢ, which ``begin`` prepares for backward Euler; ``end`` and
    ``relax`` leave the energy that is stored.

    **Energy.** With sᵢ = eₙ − qᵢ the former is μ a²/b s² ≤ μ s² at the start of the step, and μ/b s² ≥ μ s² at its end:
    each branch takes energy out of every step of every length. Explicit steps take the force at their start.

    Traps: an element that is turned inside out is, for a branch, in the same state as its mirror image; only the
    elastic law sets it right. The longest stable explicit step is that of the instantaneous modulus.
    """

    def __init__(self, elastic: LinearElements, series: Series):
        super().__init__()
        self.couples, self.series = elastic.couples, series
        self._gradients = elastic.gradients.copy()  # plasticity changes those of the elastic effect, and not these
        self._moduli = elastic.moduli[0] * elastic.volumes
        self.inner = np.zeros((len(self.couples), len(series.shares), 6))
        self._strain: np.ndarray | None = None  # at the end of the last step
        self._step, self._ended = 0.0, False
        self._prepare(0.0)

    def evaluate(self, x: np.ndarray, force: np.ndarray) -> float:
        """Add the nodal forces [N] at ``x`` (n, 3) [m] to ``force`` (n, 3), and return the energy [J]."""
        moved = energy_and_force(x, self.couples, self._gradients, self._stiffness, self._centers, force)
        return moved + self._apart

    def add_stiffness(self, x: np.ndarray, definite: bool, slots: np.ndarray, values: np.ndarray) -> None:
        """Add the Hessian's blocks to ``values`` (n_blocks, 3, 3) [N/m], those of element e at ``slots[e]`` (4, 4).

        ``definite`` leaves out the second derivatives of the strain, which vanish with the stress.
        """
        add_stiffness(x, self.couples, self._gradients, self._stiffness, self._centers, definite, slots, values)

    def begin(self, x: np.ndarray, h: float) -> np.ndarray:
        """Prepare the energy of a step of ``h`` [s] from the last positions, the first time from ``x`` (n, 3) [m]."""
        if self._strain is None:
            self._strain = self._strains(x)
        self._step = h
        self._prepare(h)
        return x

    def end(self, x: np.ndarray) -> None:
        """Update the branches by the step that has begun and ends at ``x`` (n, 3) [m]."""
        self._advance(x, self._step)
        self._ended = True

    def relax(self, x: np.ndarray, h: float) -> None:
        """Update the branches by an explicit step of ``h`` [s] that ends at ``x`` (n, 3) [m]."""
        if not self._ended:
            self._advance(x, h)
        self._ended = False

    def _advance(self, x: np.ndarray, h: float) -> None:
        if self._strain is None:  # the first explicit step begins where the force was asked for
            self._strain = self._strains(self._kept[0][0] if self._kept else x)
        before, self._strain = self._strain[:, None], self._strains(x)
        a, b = (factor[:, None] for factor in self.series.factors(h))
        self.inner = a * self.inner + (b - a) * before + (1.0 - b) * self._strain[:, None]
        self._prepare(0.0)

    def _prepare(self, h: float) -> None:
        """Set the energy of a step of ``h`` [s]: one modulus and one center for each element, and what is left."""
        self.forget()
        a, b = self.series.factors(h)
        weights = self.series.ratios * b
        kept, whole = (a / b)[:, None], weights.sum()
        centers = self.inner
        if self._strain is not None and h > 0.0:
            centers = kept * self.inner + (1.0 - kept) * self._strain[:, None]
        self._centers = np.einsum("k,mkc->mc", weights / whole, centers)
        self._stiffness = whole * self._moduli
        squares = (centers - self._centers[:, None]) ** 2 @ TWICE
        self._apart = float(self._moduli @ (squares @ weights))

    def _strains(self, x: np.ndarray) -> np.ndarray:
        found = np.empty((len(self.couples), 6))
        strains(x, self.couples, self._gradients, found)
        return found
