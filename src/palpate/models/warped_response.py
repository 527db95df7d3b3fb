"""Stored linear responses, as they are or turned with the rotations that they have themselves: no mesh is simulated.

The responses are precomputed Green's functions (James and Pai 1999, "ArtDefo"); the warp is that of Choi and Ko (2005),
"Modal warping": each node's displacement is turned by the mean of the rotations that lead up to its own.
"""

from functools import reduce

import numba
import numpy as np
from scipy import sparse

from palpate.benchmark.database import Database
from palpate.benchmark.load import Answer, Load
from palpate.bodies.contacts import row_of
from palpate.bodies.mesh import TetMesh
from palpate.effects.elements import shape_gradients
from palpate.models.depths import Discs
from palpate.solvers.compliance import Compliance


class NodalSpins:
    """Rotation vectors ½ curl u at a mesh's nodes: volume-weighted means over the elements around each node."""

    def __init__(self, mesh: TetMesh):
        self._tetrahedra = mesh.tetrahedra
        self._gradients, volumes = shape_gradients(mesh)
        rows, columns = mesh.tetrahedra.ravel(), np.repeat(np.arange(len(volumes)), 4)
        around = sparse.csr_array((np.repeat(volumes, 4), (rows, columns)), shape=(len(mesh.nodes), len(volumes)))
        self._mean = sparse.diags_array(1.0 / around.sum(axis=1)) @ around

    def of(self, displacement: np.ndarray) -> np.ndarray:
        """Return rotation vectors (n_nodes, 3) [rad] of a small ``displacement`` (n_nodes, 3) [m]; linear in it."""
        curl = np.cross(self._gradients, displacement[self._tetrahedra]).sum(axis=1)
        return self._mean @ (0.5 * curl)


@numba.njit(cache=True)
def turn(spins: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Turn each vector (n, 3) by its rotation vector (n, 3) [rad], by Rodrigues' formula."""
    return _combine(spins, vectors, 0)


@numba.njit(cache=True)
def warp(spins: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Apply to each vector (n, 3) the mean of the rotations by t times its rotation vector (n, 3), 0 ≤ t ≤ 1."""
    return _combine(spins, vectors, 1)


@numba.njit(cache=True)
def _combine(spins, vectors, mean):
    """Return vectors v turned by spins w, v + p w × v + q w × (w × v), or by the ``mean`` of rotations by 0 to w."""
    rotated = np.empty_like(vectors)
    for n in range(len(vectors)):
        w0, w1, w2 = spins[n, 0], spins[n, 1], spins[n, 2]
        v0, v1, v2 = vectors[n, 0], vectors[n, 1], vectors[n, 2]
        squared = w0 * w0 + w1 * w1 + w2 * w2
        if squared < 1e-8:  # the series; what is left out is below rounding
            sine, cosine, cubic = 1.0 - squared / 6.0, 0.5 - squared / 24.0, 1.0 / 6.0 - squared / 120.0
        else:
            angle = np.sqrt(squared)
            sine = np.sin(angle) / angle
            cosine, cubic = 2.0 * np.sin(0.5 * angle) ** 2 / squared, (1.0 - sine) / squared
        p, q = (cosine, cubic) if mean else (sine, cosine)
        c0, c1, c2 = w1 * v2 - w2 * v1, w2 * v0 - w0 * v2, w0 * v1 - w1 * v0
        rotated[n, 0] = v0 + p * c0 + q * (w1 * c2 - w2 * c1)
        rotated[n, 1] = v1 + p * c1 + q * (w2 * c0 - w0 * c2)
        rotated[n, 2] = v2 + p * c2 + q * (w0 * c1 - w1 * c0)
    return rotated


class LinearFem:
    """The linear response of fine elements to a force; the coarse simulation is not used."""

    sigma_m = np.nan

    def __init__(self, compliance: Compliance):
        self._contacts, self._columns = compliance.contacts, compliance.fine.reshape(len(compliance.fine), 3, -1)

    def predict(self, coarse: np.ndarray | None, contact: int, force: np.ndarray) -> np.ndarray:
        """Return the fine surface displacement (n, 3) [m] under ``force`` (3,) [N] at coarse node ``contact``."""
        return (force @ self._columns[row_of(self._contacts, contact)]).reshape(-1, 3)

    def answer(self, contact: int, force: np.ndarray) -> tuple[np.ndarray, None]:
        """Return the displacement as ``predict`` does, and None for rotations; InputError for an unprepared contact."""
        return self.predict(None, contact, force), None

    def superpose(self, presses: list[tuple[int, np.ndarray]]) -> np.ndarray:
        """Return the sum (n, 3) [m] of the responses to forces (3,) [N], each at its contact."""
        first, *others = [self.predict(None, *press) for press in presses]
        return np.sum([first, *others], axis=0) if others else first

    def at_depth(self, load: Load, discs: Discs) -> Answer:
        """Return the answer to a ``load`` with depths, from the exact forces of its ``discs``."""
        forces = discs.linear_forces(load)
        presses = [(press.node, force) for press, force in zip(load.presses, forces, strict=True)]
        return Answer(self.superpose(presses), forces)


class WarpedResponse:
    """u = R̃(w) C f', with the rotation vectors w of C f', and the force f' turned back by the contact's rotation.

    R̃(w) is the mean of the rotations by t w, 0 ≤ t ≤ 1; the contact's rotation is that of C f. Rotations are those of
    the fine response at the coarse nodes, interpolated: those of the fine surface gave larger errors on training
    samples of the shipped cylinder and liver, as its dents turn farther than the material below.
    """

    def __init__(self, db: Database, compliance: Compliance):
        spins = NodalSpins(TetMesh(db.coarse_nodes, db.coarse_tetrahedra))
        self._contacts, self._prolongation = compliance.contacts, db.prolongation
        self._columns = compliance.fine.reshape(len(compliance.fine), 3, -1)
        self._spins = np.array([[spins.of(u) for u in columns] for columns in compliance.restricted])

    def answer(self, contact: int, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the fine surface displacement (n, 3) [m] and the rotation vectors (n, 3) [rad] of its nodes.

        InputError for a contact that is not prepared.
        """
        return self._warped([(contact, force)])

    def superpose(self, presses: list[tuple[int, np.ndarray]]) -> np.ndarray:
        """Return the fine surface displacement (n, 3) [m] under forces (3,) [N], each at its contact.

        Rotation vectors add up as linear responses do, and each force is turned back by the sum at its contact.
        """
        return self._warped(presses)[0]

    def at_depth(self, load: Load, discs: Discs) -> Answer:
        """Return the answer to a ``load`` with depths, by a search for the forces of its ``discs``."""
        return discs.answer(load, self.superpose)

    def _warped(self, presses: list[tuple[int, np.ndarray]]) -> tuple[np.ndarray, np.ndarray]:
        """Return displacements (n, 3) [m] under forces at contacts, warped linear responses, and rotation vectors.

        Each force is turned back by the rotation of its contact under all presses before the responses are summed.
        """
        rows = [(row_of(self._contacts, contact), force) for contact, force in presses]
        spins, displacements = [], []
        for (row, force), (contact, _) in zip(rows, presses, strict=True):
            contact_spin = reduce(np.add, [force_b @ self._spins[row_b, :, contact] for row_b, force_b in rows])
            turned_force = turn(-contact_spin[None], force[None])[0]
            spins.append((turned_force @ self._spins[row].reshape(3, -1)).reshape(-1, 3))
            displacements.append((turned_force @ self._columns[row]).reshape(-1, 3))
        surface_spins = self._prolongation @ reduce(np.add, spins)
        return warp(surface_spins, reduce(np.add, displacements)), surface_spins
