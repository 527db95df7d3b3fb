"""Limit points of the corotational law itself: a body under a growing press, which snaps to another shape.

Beyond such a point no answer is nearby, so that meshes disagree, models cannot follow, and there is no truth to
measure against. Presses of the trade-off stay below them: by their peak pressure, and where that is not enough, as they
are lowered where an element is squeezed to half or the body collapses.
"""

from collections.abc import Callable, Sequence

import numpy as np
import pandas as pd

from palpate.benchmark.presses import check_radius
from palpate.bodies.body import Body
from palpate.bodies.contacts import contacts_of, kept_contacts, row_of
from palpate.bodies.refinement import finer
from palpate.effects.patch_load import nodal_load
from palpate.errors import NotConverged
from palpate.solvers.equilibrium import Equilibrium
from palpate.table_declaration import Table

LIMIT_POINTS = Table(
    "limit_points",
    "The dent under a growing pressure, contact by contact: where the law itself has more than one answer.",
    """
    body contact: the node that is pressed
    pressure_of_young: peak pressure / Young's modulus
    peak_of_size: largest displacement / the body's size
    least_det converged: least determinant of F, and whether there is an answer
    """,
    always=False,
)
PRESSURES = tuple(np.round(np.arange(0.02, 0.4001, 0.02), 2))
"""Peak pressures 2 F / (π radius²) as shares of Young's modulus, which tissue models are not meant to exceed."""
TOLERANCE = 1e-6
LEVEL = 1
"""Level of the quadratic elements: fine enough to show the law's limits, coarse enough for a minute."""


def limit_points(
    body: Body,
    radius_m: float,
    contacts: Sequence[int] | int = 4,
    pressures: Sequence[float] = PRESSURES,
    progress: Callable = iter,
) -> pd.DataFrame:
    """Press inward on a disc of ``radius_m`` [m], harder from step to step, each starting from the one before.

    contacts : coarse nodes, or how many of those that ``kept_contacts`` spreads; InputError for one that is not free,
        or for a radius that ``check_radius`` refuses
    Returns one row a step: the peak displacement reached, the smallest det F (0 and below: an element is
    inverted), and whether an equilibrium was found; if not, the first two are empty, and the contact ends there.
    """
    check_radius(body, radius_m)
    able = contacts_of(body)
    chosen = kept_contacts(body, contacts) if isinstance(contacts, int) else np.asarray(contacts)
    for contact in chosen:
        row_of(able, int(contact), f"tradeoff.limit_points.contacts of {body.name}: ")
    level = min(LEVEL, len(body.levels) - 1)
    whole = body if level + 1 < len(body.levels) else finer(body)
    problem = Equilibrium(whole, level, order=2)
    rows: list[list] = []
    for contact in progress([int(c) for c in chosen]):
        inward = -body.fine.normals[contact] * body.material.young_pa * np.pi * radius_m**2 / 2.0
        unit = nodal_load(whole, level, contact, inward, radius_m, order=2)
        rows += [[body.name, contact, *step] for step in _curve(problem, unit, pressures, body.fine.size)]
    return LIMIT_POINTS.frame(rows)


def _curve(problem: Equilibrium, unit: np.ndarray, pressures: Sequence[float], size: float) -> list[list]:
    """Return pressure, peak over ``size`` [m], smallest det F and success of each step."""
    steps: list[list] = []
    x = None
    for pressure in pressures:
        try:
            x = problem.solve(pressure * unit, TOLERANCE, start=x).x
        except NotConverged:
            return [*steps, [pressure, np.nan, np.nan, False]]
        peak = float(np.linalg.norm(x - problem.mesh.nodes, axis=1).max())
        steps.append([pressure, peak / size, problem.least_det(x), True])
    return steps
