"""Reduce a held body to modes of motion: vibrations, answers to loads, and how those bend as they grow.

The elastic energy is that of the mean deformation of cells.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement
from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import LinearOperator, eigsh

from palpate.bodies.particles import Particles
from palpate.effects import push
from palpate.effects.effect import Weight
from palpate.effects.elements import Elements
from palpate.effects.linear_elements import LinearElements
from palpate.errors import InputError
from palpate.linalg.multigrid import Factor
from palpate.models.contact_modes.reduced_contact import Cells, cell_stresses
from palpate.solvers.system import System


class AveragedCells:
    """E(q) = Σ V Ψ(F) + ½ qᵀ(ΦᵀKΦ − K_cells) q, F being the mean deformation gradient of a cell at X + Φ q.

    A cell is the ``8**coarsened`` elements, one after another, of the element ``coarsened`` levels up.
    The second term puts right what averaging loses for small motions: the stiffness K at rest is exact.

    r modes, ``modulus`` (r, r) [J] is that term's matrix
    """

    def __init__(self, elastic: LinearElements, modes: np.ndarray, stiffness: sparse.sparray, coarsened: int):
        """Average ``modes`` (3n, r) over cells; InputError if the elements are not those of split ones."""
        together = 8**coarsened
        if len(elastic.tetrahedra) % together:
            raise InputError(
                f"reduced.coarsened is {coarsened}, and {len(elastic.tetrahedra)} elements are no multiple of "
                f"{together}; give at most the level of the scene."
            )
        self.volumes = elastic.volumes.reshape(-1, together).sum(axis=1)
        shares = elastic.volumes.reshape(-1, together, 1, 1) / self.volumes[:, None, None, None]
        count, r = len(self.volumes), modes.shape[1]
        means = np.empty((9, count, r))
        for k, mode in enumerate(modes.T):
            of_elements = np.einsum("eai,eaj->eij", mode.reshape(-1, 3)[elastic.tetrahedra], elastic.gradients)
            mean = (shares * of_elements.reshape(count, together, 3, 3)).sum(axis=1)
            means[:, :, k] = mean.reshape(count, 9).T
        moduli = [_mean(m, elastic.volumes, together) for m in elastic.moduli]
        cells = Cells(means, self.volumes, *moduli)
        self._means, self._law = means.reshape(9 * count, r), elastic.law
        self._moduli, self._stresses = moduli, np.empty((9, count))
        self._scratch = np.empty((9, count)), np.empty(count), np.empty(count, dtype=bool)
        self.modulus = modes.T @ (stiffness @ modes) - cells.stiffness

    def evaluate(self, q: np.ndarray) -> tuple[float, np.ndarray]:
        """Return the energy [J] at ``q`` (r,) and its gradient (r,)."""
        f, energies, accepted = self._scratch
        mu, lam = self._moduli
        energy = cell_stresses(q, self._means, self.volumes, mu, lam, *self._law, f, self._stresses, energies, accepted)
        rest = self.modulus @ q
        return energy + 0.5 * float(q @ rest), self._stresses.ravel() @ self._means + rest

    def least_det(self, q: np.ndarray) -> float:
        """Return the smallest det F of all cells at ``q`` (r,)."""
        f = (self._means @ q).reshape(3, 3, -1).transpose(2, 0, 1) + np.eye(3)
        return float(np.linalg.det(f).min())


def _mean(moduli: np.ndarray, volumes: np.ndarray, together: int) -> np.ndarray:
    """Return the means (n_cells,) of ``moduli`` (n_elements,), by volume."""
    sums = (np.broadcast_to(moduli, volumes.shape) * volumes).reshape(-1, together).sum(axis=1)
    return sums / volumes.reshape(-1, together).sum(axis=1)


BEND_STEP = 0.01
"""Largest displacement of a column at which its bend is measured, in sizes of the body."""
DEPENDENT = 1e-9
"""Columns count as dependent below this eigenvalue of their Gram matrix, in parts of its largest."""

Solve = Callable[[np.ndarray], np.ndarray]
"""The inverse of the stiffness at rest: forces (n, 3) [N] to displacements (n, 3) [m], zero at held nodes."""


def bends(elastic: Elements, rest: np.ndarray, solve: Solve, columns: np.ndarray, size: float) -> np.ndarray:
    """Compute the static derivatives −K⁻¹ ∂²f[a, b] of all pairs of ``columns`` (k, n, 3): (k (k + 1) / 2, n, 3).

    Columns are scaled to a peak of 1 before; ∂²f, f being the elastic restoring force, is by central differences at
    BEND_STEP · ``size`` [m] (Idelsohn and Cardona 1985; Barbič and James 2005, section 4).
    """
    scaled = columns / np.linalg.norm(columns, axis=2).max(axis=1)[:, None, None]
    h = BEND_STEP * size

    def curvature(u: np.ndarray) -> np.ndarray:
        return -(elastic.force(rest + h * u) + elastic.force(rest - h * u)) / h**2

    own = [curvature(u) for u in scaled]
    derivatives = []
    for a, b in combinations_with_replacement(range(len(scaled)), 2):
        mixed = own[a] if a == b else 0.5 * (curvature(scaled[a] + scaled[b]) - own[a] - own[b])
        derivatives.append(-solve(mixed))
    return np.array(derivatives).reshape(-1, *rest.shape)


def orthonormal(columns: Sequence[np.ndarray], stiffness: sparse.sparray) -> np.ndarray:
    """Return columns (3n, r) that span those given, each (k, n, 3), and are orthonormal in ``stiffness`` (3n, 3n).

    Columns that depend on others are left out, so r may be less than the number given.
    """
    v = np.concatenate([each.reshape(len(each), -1) for each in columns if len(each)]).T
    v = v[:, np.abs(v).max(axis=0) > 0.0]
    v = v / np.sqrt(np.einsum("ij,ij->j", v, stiffness @ v))
    values, turns = np.linalg.eigh(v.T @ (stiffness @ v))
    kept = values > DEPENDENT * values[-1]
    return v @ (turns[:, kept] / np.sqrt(values[kept]))


def vibrations(
    solve: Callable[[np.ndarray], np.ndarray], masses: np.ndarray, free: np.ndarray, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """Compute the slowest ``count`` modes (count, n, 3) with φᵀMφ = 1, and their angular frequencies (count,) [1/s].

    solve : applies the inverse of the stiffness at rest to forces (n, 3) [N], held nodes staying where they are
    masses : (n,) [kg]; free : (n,) bool
    They are the largest eigenvectors of M^½ K⁻¹ M^½, so that no matrix is needed. InputError if there are not so many.
    """
    if count >= 3 * free.sum():
        raise InputError(
            f"reduced.vibrations is {count}, and the body has {3 * free.sum()} free coordinates; ask less."
        )
    if not count:
        return np.empty((0, len(masses), 3)), np.empty(0)
    root = np.sqrt(masses * free)[:, None]

    def product(y: np.ndarray) -> np.ndarray:
        return (root * solve(root * y.reshape(-1, 3))).ravel()

    operator = LinearOperator(2 * (root.size * 3,), product, dtype=float)
    start = np.random.default_rng(0).normal(size=root.size * 3)  # fixed, so that the result is reproducible
    squares, vectors = eigsh(operator, count, which="LA", v0=start)
    frequencies = 1.0 / np.sqrt(squares[::-1])
    modes = [w**2 * solve(root * y.reshape(-1, 3)) for w, y in zip(frequencies, vectors.T[::-1], strict=True)]
    return np.array(modes), frequencies


AT_ONCE = {"start_s": 0.0, "press_s": 0.0, "hold_s": np.inf, "release_s": 0.0}


@dataclass(frozen=True, eq=False)
class ReducedBody:
    """Modes in which neither mass nor stiffness couples coordinates, and the cells that give the elastic energy.

    modes : (3n, r), with φᵀKφ = 1, so that coordinates are in √J; masses : (r,), φᵀMφ
    """

    modes: np.ndarray
    masses: np.ndarray
    cells: AveragedCells

    @classmethod
    def of(cls, system: System, settings: dict[str, Any]) -> "ReducedBody":
        """Reduce a body at rest; ``settings`` are the scene's block ``reduced``.

        vibrations : number of vibration modes; bent : how many of them get second-order modes, with those of weight
        places : discs {at_m, radius_m} that a push gets modes for: three for unit forces, and six of second order
        coarsened : levels by which cells are coarser than elements
        InputError if nothing is held, for a place that cannot be pressed, and for more modes than coordinates.
        """
        elastic, particles = system.elastic, system.particles
        assert isinstance(elastic, LinearElements)  # as ``make`` of the integrator asks for
        if system.free.all():
            raise InputError("it needs a body that is held, as one that is not drifts out of all modes; choose bdf2.")
        stiffness = system.stiffness(particles.nodes, definite=True)
        assert stiffness is not None  # finite elements have one
        system.hold(stiffness)
        solve = _solver(stiffness, system.free)
        swinging, _ = vibrations(solve, particles.masses, system.free, settings["vibrations"])
        # forces (3, n, 3) [N] of 1 m/s² along x, y and z, if a weight acts
        weights = [system.masses[None, :, None] * np.eye(3)[:, None, :] for _ in system.offering(Weight)]
        loads = [*_unit_pushes(particles, settings["places"]), *weights]
        groups = [np.concatenate([_answers(solve, each), swinging[: settings["bent"]]]) for each in loads]
        size = particles.size
        second = [bends(elastic, particles.nodes, solve, each, size) for each in groups if len(each)]
        matrix = stiffness.tocsr()
        columns = orthonormal([swinging, *groups, *second], matrix)
        # turned so that mass couples them no longer; columns that are orthonormal in the stiffness stay so
        free = np.repeat(particles.masses * system.free, 3)[:, None]
        masses, turns = np.linalg.eigh(columns.T @ (free * columns))
        modes = np.ascontiguousarray(columns @ turns)
        return cls(modes, masses, AveragedCells(elastic, modes, matrix, settings["coarsened"]))

    @property
    def count(self) -> int:
        """The number of modes."""
        return len(self.masses)

    def project(self, force: np.ndarray) -> np.ndarray:
        """Return the share (r,) of a force (n, 3) [N] in each mode."""
        return force.ravel() @ self.modes

    def expand(self, q: np.ndarray) -> np.ndarray:
        """Return displacements (n, 3) [m] at coordinates ``q`` (r,), or velocities of their rates."""
        return (self.modes @ q).reshape(-1, 3)


def _solver(stiffness: sparse.bsr_array, free: np.ndarray) -> Solve:
    """Factorise ``stiffness``, whose held rows are those of the identity; forces on held nodes have no effect."""
    factor = Factor(stiffness)
    return lambda force: factor.solve(np.where(free[:, None], force, 0.0))


def _answers(solve: Solve, forces: np.ndarray) -> np.ndarray:
    """Return linear answers (k, n, 3) [m] to ``forces`` (k, n, 3) [N]."""
    return np.array([solve(force) for force in forces]).reshape(forces.shape)


def _unit_pushes(particles: Particles, places: list[dict]) -> list[np.ndarray]:
    """Return for each place the nodal forces (3, n, 3) [N] of 1 N along x, y and z; InputError as ``push.make``."""
    pushes = []
    for place in places:
        forces = np.zeros((3, *particles.nodes.shape))
        for unit, force in zip(np.eye(3), forces, strict=True):
            load = push.make(particles, {"loads": [place | AT_ONCE | {"force_n": unit}]}, None)
            load.at(0.0)
            load.add_force(particles.nodes, force, force)
        pushes.append(forces)
    return pushes
