"""Modes of a body of quadratic elements that an instrument strokes: vibrations and the strongest motions of strokes.

The elastic energy is that of few weighted cubature points, fitted to the elements' forces in those motions.
"""

from dataclasses import dataclass, replace

import numpy as np

from palpate.bodies.body import Body
from palpate.effects.settings import Loads, Touching
from palpate.errors import InputError
from palpate.linalg.multigrid import Factor
from palpate.models.contact_modes.elements_at_rest import ElementsAtRest
from palpate.models.local_answers import LocalAnswers, local_answers
from palpate.models.reduced.basis import independent, orthonormal, products, vibrations
from palpate.models.reduced.cubature import energy_of_elements
from palpate.models.reduced.energy import ReducedEnergy
from palpate.models.reduced_body import RESIDUAL, UNDAMPED
from palpate.models.strokes import whole_of
from palpate.solvers.indentation import ContactPoints
from palpate.solvers.quadratic_motion import QuadraticMotion
from palpate.solvers.system import System
from palpate.solvers.touched_motion import STIFFER

FLATTER = 0.25
"""Motions of training strokes count as their energy to this power: large ones more than small ones, but less so."""
FAINT = 1e-6
"""Of the largest energy, below which a motion is left out: rounding would make modes of it."""
DEPENDENT = 1e-12
"""Motions count as dependent on others below this eigenvalue of their products, in parts of its largest."""


@dataclass(frozen=True, eq=False)
class StrokeModes:
    """Modes (n, 3, r) in which stiffness at rest is the identity and mass diagonal, (r,): coordinates are in √J.

    body, elements, motion : the body, quadratic ``elements`` on its finest level, and the masses of these
    model : the energy of few cubature points
    points, rows : that instruments may touch, and the displacement (q, 3, r) of each in each mode
    local : the dents that modes lack there, if these are not those of the strokes
    """

    body: Body
    elements: ElementsAtRest
    motion: QuadraticMotion
    modes: np.ndarray
    masses: np.ndarray
    model: ReducedEnergy
    points: ContactPoints
    rows: np.ndarray
    local: LocalAnswers | None = None

    @property
    def count(self) -> int:
        """The number of modes."""
        return len(self.masses)


def learn(
    system: System, shown: np.ndarray, points: ContactPoints, settings: Touching, anywhere: bool = False
) -> StrokeModes:
    """Return modes of displacements ``shown`` (s, n, 3) [m] of quadratic elements, and the energy in them.

    system : of the body, as finite elements on its own mesh; points : that may be touched
    anywhere : whether dents are not those of the strokes, so that they need responses of their own
    InputError for motions of a body with other nodes, or in which nothing moves.
    """
    body = system.particles.body
    assert body is not None  # as the integrator asks for
    refined, level = whole_of(body), len(body.levels) - 1
    elements, motion = ElementsAtRest(refined, level), QuadraticMotion(refined, level, Loads(), UNDAMPED)
    if shown.shape[1:] != elements.rest.shape:
        raise InputError(
            f"modes are learnt from motions of {shown.shape[1]} nodes, quadratic elements of {body.name} have "
            f"{len(elements.rest)}; show it strokes of its own."
        )
    motions = np.ascontiguousarray(shown.transpose(1, 2, 0), dtype=float)
    motion_forces = elements.multiply(motions)
    strongest = motions @ strongest_of(products(motions, motion_forces), settings.modes)
    columns = orthonormal(elements, np.dstack([_swings(system, refined, elements, motion, settings), strongest]))
    masses, turns = np.linalg.eigh(products(columns, (motion.masses @ columns.reshape(len(columns), -1))))
    modes = columns @ turns
    touched = np.zeros(len(elements.rest), dtype=bool)
    touched[points.interpolation.indices] = True
    near, states = touched[elements.couples].any(axis=1), states_of(products(motion_forces, modes), settings.states)
    model = energy_of_elements(elements, modes, near, states, settings.thinning, np.random.default_rng(0))
    rows = (points.interpolation @ modes.reshape(len(modes), -1)).reshape(-1, 3, len(masses))
    if not anywhere:
        return StrokeModes(body, elements, motion, modes, masses, model, points, rows)
    stiffer_points = replace(points, penalty=STIFFER * points.penalty)  # as dents can follow an instrument
    local = local_answers(elements, modes, points, len(body.fine.nodes))
    return StrokeModes(body, elements, motion, modes, masses, model, stiffer_points, rows, local)


def _swings(
    system: System, whole: Body, elements: ElementsAtRest, motion: QuadraticMotion, settings: Touching
) -> np.ndarray:
    """Return responses (n, 3, k) to the inertia of the slowest vibrations of linear elements on the same mesh."""
    particles, stiffness = system.particles, system.stiffness(system.particles.nodes, definite=True)
    assert stiffness is not None  # finite elements have one
    system.hold(stiffness)
    factor, free = Factor(stiffness), system.free[:, None]
    slowest, _ = vibrations(
        lambda f: factor.solve(np.where(free, f, 0.0)), particles.masses, system.free, settings.vibrations
    )
    to_quadratic = whole.prolongations[len(whole.levels) - 2]
    inertia = motion.masses @ (to_quadratic @ slowest.transpose(1, 2, 0).reshape(len(free), -1))
    return elements.solve(inertia.reshape(len(motion.rest), 3, len(slowest)), RESIDUAL)


def strongest_of(square: np.ndarray, count: int) -> np.ndarray:
    """Return the combinations (s, count) of s motions that are the ``count`` modes of most energy.

    square : (s, s) [J], the products of the motions with their forces. By the method of snapshots; InputError if
        nothing moves.
    """
    energies = np.diag(square)
    strong = energies > FAINT * energies.max(initial=0.0)
    if not strong.any():
        raise InputError(
            "nothing moves in the strokes that modes are learnt from, as the instrument meets none of the points of "
            "the surface that feel contact; lead it deeper, or take a larger one or a finer level."
        )
    sizes = np.where(strong, np.maximum(energies, 0.0), 0.0) ** FLATTER
    return independent(square, sizes, DEPENDENT)[:, -count:]


def states_of(coordinates: np.ndarray, count: int) -> np.ndarray:
    """Return ``count`` of ``coordinates`` (s, r): the largest first, then each the farthest from those before it."""
    distances = np.linalg.norm(coordinates, axis=1)
    chosen: list[int] = []
    while len(chosen) < min(count, len(coordinates)) and distances.max() > 0.0:
        chosen.append(int(np.argmax(distances)))
        distances = np.minimum(distances, np.linalg.norm(coordinates - coordinates[chosen[-1]], axis=1))
    return coordinates[chosen]
