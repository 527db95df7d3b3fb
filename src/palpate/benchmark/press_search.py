"""Find the force of a press that moves a body as far as asked, or the largest below that the body bears."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from palpate.bodies.body import Body
from palpate.bodies.refinement import finer
from palpate.effects.patch_load import nodal_load
from palpate.effects.surface_integrals import enclosed_volume
from palpate.errors import NotConverged
from palpate.solvers.equilibrium import FastEquilibrium

NEAR = 0.05
"""Relative difference from the wanted peak up to which a force counts as found."""
PRESSURE = 0.25
"""Peak pressure as a share of Young's modulus that no press exceeds, unless the regime says otherwise."""
DEEPEST = 0.15
"""Share of the body's size by which a press of a regime without peak_of_size moves it at most: slender bodies bend."""
TOLERANCE = 1e-4
"""Relative residual of the solves that the search takes: far below NEAR."""
SOUND = 0.5
"""The smallest det F that a press may reach: finer meshes reach less, and below there is no truth to compare with."""
FIRST = 0.7
"""Share of a hard press that the search tries first."""
TRIES, CLOSE = 12, 0.02
"""Solves that a press may take, and how near two forces on either side of a jump are when the search ends."""
LOWER, CLEAR = 0.85, 0.6
"""Factors by which a press that fails is lowered, then the one that holds: finer meshes are softer and fail earlier.

The thin lobe of the liver snaps at 0.19 of Young's modulus on level 1, and below 0.154 on level 2.
"""
UNCAPPED = "no"
FAILED = ("inverted", "squeezed", "unstable")
"""Why a press is lowered at a force at which the body itself gives way, whatever was asked for."""


@dataclass(frozen=True, eq=False)
class Tried:
    """A press tried: its force [N], the displacements (n, 3) [m], their peak [m], the smallest det F, what is wrong."""

    newtons: float
    moved: np.ndarray
    peak: float
    least_det: float
    wrong: str = ""


class PressSearch:
    """Forces on one body, found with quadratic elements on the last level but one.

    regime, radius_m : as of ``choose_presses``
    """

    def __init__(self, body: Body, regime: Mapping, radius_m: float):
        self._level = max(len(body.levels) - 2, 0)
        self._body = body if len(body.levels) > 1 else finer(body)
        self._solver = FastEquilibrium(self._body, self._level, order=2)
        self._linear = self._solver.linear_solver(1e-6)
        self._radius = radius_m
        self._free = "peak_of_size" not in regime
        self._peak = regime.get("peak_of_size", DEEPEST) * body.fine.size
        self._most = regime.get("pressure_of_young", PRESSURE) / self.pressure(1.0)

    def pressure(self, newtons: float) -> float:
        """Return the peak pressure of a force [N] as a share of Young's modulus."""
        return 2.0 * newtons / (np.pi * self._radius**2) / self._body.material.young_pa

    def volume_change(self, moved: np.ndarray) -> float:
        """Return the change of the body's volume under displacements (n, 3) [m], over its volume at rest."""
        mesh, rest = self._body.levels[self._level], self._solver.mesh.nodes
        return enclosed_volume(mesh, rest + moved) / enclosed_volume(mesh, rest) - 1.0

    def find(
        self, contact: int, direction: np.ndarray, magnitude: float, bound: float = np.inf, why: str = ""
    ) -> tuple[Tried, str]:
        """Find the press along ``direction`` (3,) that is as deep as asked, or the deepest one below and why.

        bound : force [N] that it may not exceed, because of ``why``
        """
        unit = nodal_load(self._body, self._level, contact, direction, self._radius, order=2)
        wanted, most = magnitude * self._peak, self._most * (magnitude if self._free else 1.0)
        limit = UNCAPPED if self._free else "pressure"
        if bound < most:
            most, limit = bound, why
        stiffness = 1.0 / _peak(self._linear(unit))
        low, high = Tried(0.0, np.zeros_like(unit), 0.0, 1.0), None
        newtons = min(wanted * stiffness, most)
        if newtons > self._most / 2.0:  # not at once to where the body may collapse, which takes long to find out
            newtons *= FIRST
        for _ in range(TRIES):
            tried = self._press(newtons * unit, newtons, low)
            if not tried.wrong and abs(tried.peak / wanted - 1.0) <= NEAR:
                if self._free:
                    return tried, "peak" if newtons < most else limit
                return tried, UNCAPPED
            if not tried.wrong and tried.peak < wanted:
                low = tried
                if newtons >= most:
                    return low, limit
            else:
                high = tried
            if high is not None and low.newtons > (0.99 * LOWER if high.wrong else 1.0 - CLOSE) * high.newtons:
                break
            newtons = _next(low, high, wanted, stiffness, most)
        if not low.newtons:
            raise NotConverged(
                f"{self._body.name}, contact {contact}: no press was found at which all elements keep their shape; "
                "lower the regime's peak_of_size or pressure_of_young, or give a larger radius_m.",
                [],
            )
        lower = self._press(CLEAR * low.newtons * unit, CLEAR * low.newtons, low)
        low = low if lower.wrong else lower
        return low, (high.wrong if high is not None else "") or "unstable"

    def _press(self, load: np.ndarray, newtons: float, below: Tried) -> Tried:
        """Solve, starting from the press ``below`` as if displacements grew with the force."""
        rest = self._solver.mesh.nodes
        start = rest + below.moved * (newtons / below.newtons) if below.newtons > 0.0 else None
        try:
            x = self._solver.solve(load, TOLERANCE, start=start).x
        except NotConverged:
            return Tried(newtons, below.moved, np.inf, -np.inf, "unstable")
        least = self._solver.least_det(x)
        wrong = "" if least >= SOUND else "squeezed" if least > 0.0 else "inverted"
        return Tried(newtons, x - rest, _peak(x - rest), least, wrong)


def _next(low: Tried, high: Tried | None, wanted: float, stiffness: float, most: float) -> float:
    """Return the next force to try [N], between ``low`` and ``high``.

    Force over peak changes nearly in proportion to the peak, from ``stiffness`` [N/m] at rest.
    """
    sound = [press for press in (low, high) if press is not None and press.peak > 0.0 and not press.wrong]
    known = [(0.0, stiffness), *((press.peak, press.newtons / press.peak) for press in sound)]
    if len(known) == 1:
        return 0.5 * most if high is None else 0.5 * high.newtons
    (p, q), (r, s) = known[-2:]
    newtons = wanted * (q + (s - q) * (wanted - p) / (r - p))
    least = (1.0 + CLOSE / 2.0) * low.newtons
    largest = most
    if high is not None:
        largest = LOWER * high.newtons if high.wrong else high.newtons - (high.newtons - low.newtons) / 8.0
    # a step beyond twice the force of a known press is a guess
    return float(np.clip(newtons, least, min(largest, 2.0 * low.newtons) if low.newtons else largest))


def _peak(displacement: np.ndarray) -> float:
    return float(np.linalg.norm(displacement, axis=1).max())
