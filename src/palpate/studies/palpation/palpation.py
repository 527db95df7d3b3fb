"""Palpation of a body with regions: force against depth at several places, with the regions and without them."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from palpate.bodies.body import Body
from palpate.bodies.contacts import contacts_near_regions
from palpate.bodies.refinement import finer
from palpate.effects.patch_load import nodal_load
from palpate.errors import InputError
from palpate.solvers.equilibrium import Equilibrium
from palpate.table import Table

TOLERANCE = 1e-7
"""Relative residual of the solves: differences between two bodies are to be exact to 1e-5."""


class PressCurves:
    """A body with its regions and the same body of its own material alone, on the same mesh of quadratic elements.

    The elements are those of the last level but one, whose nodes are those of the fine mesh, or of the only level.
    ``products`` counts the products with a stiffness matrix so far.
    """

    def __init__(self, body: Body, radius_m: float):
        self._level, self._radius_m, self.products = max(len(body.levels) - 2, 0), radius_m, 0
        self._body = body if len(body.levels) > 1 else finer(body)
        self._problems: dict[bool, Equilibrium] = {}

    def forces(self, pressures: Sequence[float]) -> np.ndarray:
        """Return the forces (k,) [N] of peak pressures, as shares of the body's own modulus."""
        return np.asarray(pressures) * self._body.material.young_pa * np.pi * self._radius_m**2 / 2.0

    def depths(self, contact: int, forces: np.ndarray, regions: bool) -> np.ndarray:
        """Return how deep (k,) [m] the patch at a coarse node moves under each inward force, smallest first.

        The depth is the mean of the inward displacement, weighted by the pressure: force times depth is the work.
        Raises NotConverged if there is no equilibrium.
        """
        inward = -self._body.fine.normals[contact]
        unit = nodal_load(self._body, self._level, contact, inward, self._radius_m, order=2)
        problem, found = self._problem(regions), []
        rest, moved, last = problem.mesh.nodes, np.zeros_like(unit), 1.0
        for force in forces:
            # from the press before, as if displacements grew with the force
            solution = problem.solve(force * unit, TOLERANCE, start=rest + moved * (force / last))
            moved, last = solution.x - rest, force
            self.products += solution.products
            found.append(float(np.vdot(unit, moved)))
        return np.array(found)

    def _problem(self, regions: bool) -> Equilibrium:
        if regions not in self._problems:
            body = self._body if regions else replace(self._body, regions=None)
            self._problems[regions] = Equilibrium(body, self._level, order=2)
        return self._problems[regions]


PALPATION = Table(
    "palpation",
    "Force and depth of a finger's presses at places ever farther from a region, and the depth without it.",
    """
    body contact: a body, and the node that is pressed
    cover_m: distance from the place to the elements of a region, 0 where they reach it [m]
    force_n depth_m depth_without_m: force [N], depth of the press, and that on the body of its own material alone [m]
    stiffer: by what share the place resists more than without regions
    felt threshold: whether a finger feels the difference, and from what share on
    """,
)


def palpate(
    body: Body,
    radius_m: float,
    places: int,
    pressures_of_young: Sequence[float],
    felt: float,
    progress: Callable = iter,
) -> pd.DataFrame:
    """Press at ``places`` contacts, from above a region outwards; one row a force.

    pressures_of_young : peak pressures of a press as shares of the body's own modulus
    felt : from what share of ``stiffer`` on a finger feels the difference

    Raises InputError if the body has no regions; NotConverged if a press has no equilibrium.
    """
    if body.regions is None:
        raise InputError(f"bodies.{body.name} has no regions, so there is nothing to feel; give it some.")
    contacts, covers = contacts_near_regions(body, places)
    curves, rows = PressCurves(body, radius_m), []
    forces = curves.forces(sorted(pressures_of_young))
    for contact, cover in progress(list(zip(contacts, covers, strict=True))):
        with_regions, without = (curves.depths(int(contact), forces, regions) for regions in (True, False))
        stiffer = without / with_regions - 1.0
        columns = (forces, with_regions, without, stiffer, np.abs(stiffer) >= felt)
        rows += [[body.name, int(contact), cover, *row, felt] for row in zip(*columns, strict=True)]
    return PALPATION.frame(rows)
