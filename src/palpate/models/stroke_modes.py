"""Modes of a body that an instrument strokes: vibrations and the strongest motions of training strokes.

The elastic energy is that of few weighted elements, which pull as all do in those motions.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from palpate.collision.contact.instrument_contact import reachable
from palpate.effects.effect import Rigid
from palpate.effects.linear_elements import LinearElements
from palpate.errors import InputError
from palpate.linalg.multigrid import Factor
from palpate.models.contact_modes.reduced_contact import Cells, ReducedContact
from palpate.models.reduced_body import vibrations
from palpate.solvers.system import System

FLATTER = 0.25
"""Motions of training strokes count as their energy to this power: large ones more than small ones, but less so."""
FAINT = 1e-6
"""Of the largest energy, below which a motion is left out: rounding would make modes of it."""
DEPENDENT = 1e-12
"""Of the strongest, below which a mode is none."""
SPANNED = 1e-9
"""Columns count as dependent below this eigenvalue of their Gram matrix, in parts of its largest."""


@dataclass(frozen=True, eq=False)
class StrokeModes:
    """Modes (3n, r) in which stiffness at rest is the identity and mass diagonal, (r,): coordinates are in √J.

    elements, weights : (k,) numbers of the elements that give the energy, and their weights
    modulus : (r, r) [J], what their stiffness at rest lacks
    reach : (p,) nodes that an instrument may touch
    """

    modes: np.ndarray
    masses: np.ndarray
    elements: np.ndarray
    weights: np.ndarray
    modulus: np.ndarray
    reach: np.ndarray

    @property
    def count(self) -> int:
        """The number of modes."""
        return len(self.masses)

    def expand(self, q: np.ndarray) -> np.ndarray:
        """Return displacements (n, 3) [m] at coordinates ``q`` (r,), or velocities of their rates."""
        return (self.modes @ q).reshape(-1, 3)


def stiffness_at_rest(system: System) -> sparse.bsr_array:
    """Return the stiffness (3n, 3n) [N/m], with the rows of held nodes those of the identity."""
    found = system.stiffness(system.particles.nodes, definite=True)
    assert found is not None  # finite elements have one
    system.hold(found)
    return found


def learn(system: System, shown: np.ndarray, reach: np.ndarray, settings: dict) -> StrokeModes:
    """Find modes of displacements ``shown`` (s, n, 3) [m], and few elements.

    settings : ``vibrations`` and ``modes``, how many of each; ``states``, at how many of the motions the elements pull
        as all do, to the relative ``thinning``; 0 keeps all elements
    InputError for motions of a body with other nodes, or in which nothing moves.
    """
    particles, elastic = system.particles, system.elastic
    assert isinstance(elastic, LinearElements)  # as the integrator asks for
    if shown.shape[1:] != particles.nodes.shape:
        raise InputError(
            f"modes are learnt from motions of {shown.shape[1]} nodes, {particles.name} has {len(particles.nodes)}; "
            "show it strokes of its own."
        )
    stiffness = stiffness_at_rest(system)
    matrix, free, factor = stiffness.tocsr(), system.free[:, None], Factor(stiffness)
    swinging, _ = vibrations(
        lambda force: factor.solve(np.where(free, force, 0.0)), particles.masses, system.free, settings["vibrations"]
    )
    flat = (shown * free).reshape(len(shown), -1)
    strongest = strongest_of(flat, matrix, settings["modes"])
    columns = orthonormal([swinging, strongest.reshape(-1, *particles.nodes.shape)], matrix)
    masses, turns = np.linalg.eigh(columns.T @ (np.repeat(particles.masses * system.free, 3)[:, None] * columns))
    modes = np.ascontiguousarray(columns @ turns)
    cells = cells_of(elastic, modes)
    elements, weights = np.arange(len(elastic.volumes)), np.ones(len(elastic.volumes))
    if settings["thinning"]:
        answers = states_of((matrix @ flat.T).T @ modes, settings["states"])
        elements, weights = ReducedContact(cells, np.empty((modes.shape[1], 0)), elastic.law).few(
            list(answers), settings["thinning"]
        )
    modulus = np.eye(len(masses)) - cells.take(elements, weights).stiffness
    return StrokeModes(modes, masses, elements, weights, modulus, reach)


def strongest_of(motions: np.ndarray, stiffness: sparse.sparray, count: int) -> np.ndarray:
    """Return the ``count`` strongest modes (count, 3n) of ``motions`` (s, 3n) in energy, by the method of snapshots.

    InputError if nothing moves.
    """
    energies = np.einsum("ij,ij->i", motions, (stiffness @ motions.T).T)
    kept = energies > FAINT * energies.max(initial=0.0)
    if not kept.any():
        raise InputError("nothing moves in the strokes that modes are learnt from; let the instrument touch the body.")
    motions = motions[kept] / energies[kept, None] ** FLATTER
    values, turns = np.linalg.eigh(motions @ (stiffness @ motions.T))
    first = np.arange(len(values))[::-1][:count]
    return turns[:, first[values[first] > DEPENDENT * values[-1]]].T @ motions


def states_of(coordinates: np.ndarray, count: int) -> np.ndarray:
    """Choose so many of ``coordinates`` (s, r), each the farthest from those chosen already, the largest first."""
    away = np.linalg.norm(coordinates, axis=1)
    chosen: list[int] = []
    while len(chosen) < min(count, len(coordinates)) and away.max() > 0.0:
        chosen.append(int(np.argmax(away)))
        away = np.minimum(away, np.linalg.norm(coordinates - coordinates[chosen[-1]], axis=1))
    return coordinates[chosen]


def cells_of(elastic: LinearElements, modes: np.ndarray) -> Cells:
    """Return each element as a cell of ``modes`` (3n, r)."""
    moved = modes.reshape(-1, 3, modes.shape[1])[elastic.tetrahedra]
    slopes = np.einsum("eair,eaj->ijer", moved, elastic.gradients).reshape(9, -1, modes.shape[1])
    moduli = (np.broadcast_to(m, elastic.volumes.shape).copy() for m in elastic.moduli)
    return Cells(np.ascontiguousarray(slopes), elastic.volumes, *moduli)


def reach_of(system: System, paths: Sequence[tuple[Sequence[Rigid], float]], margin_m: float) -> np.ndarray:
    """Return the surface nodes (p,) that come within ``margin_m`` [m] of instruments until some time [s] each."""
    nodes, triangles = system.particles.nodes, system.particles.triangles
    found = [reachable(nodes, triangles, obstacles, margin_m, until_s) for obstacles, until_s in paths]
    return np.unique(np.concatenate(found))


def belongs(body: StrokeModes, system: System) -> bool:
    """Tell whether modes are those of a system's body: its mass and its stiffness at rest are what they say."""
    if len(body.modes) != 3 * len(system.masses):
        return False
    motion = body.modes.sum(axis=1)
    stiff = float(motion @ (stiffness_at_rest(system) @ motion))
    heavy = float(motion @ (np.repeat(system.masses * system.free, 3) * motion))
    return bool(np.isclose(stiff, body.count, rtol=1e-4) and np.isclose(heavy, body.masses.sum(), rtol=1e-4))


def orthonormal(columns: Sequence[np.ndarray], stiffness: sparse.sparray) -> np.ndarray:
    """Return columns (3n, r) that span those given, each (k, n, 3), and are orthonormal in ``stiffness`` (3n, 3n).

    Columns that depend on others are left out, so r may be less than the number given.
    """
    v = np.concatenate([each.reshape(len(each), -1) for each in columns if len(each)]).T
    v = v[:, np.abs(v).max(axis=0) > 0.0]
    v = v / np.sqrt(np.einsum("ij,ij->j", v, stiffness @ v))
    values, turns = np.linalg.eigh(v.T @ (stiffness @ v))
    kept = values > SPANNED * values[-1]
    return v @ (turns[:, kept] / np.sqrt(values[kept]))
