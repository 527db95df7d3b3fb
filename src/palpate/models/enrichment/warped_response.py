"""Answer with stored linear responses, turned with the rotations that they have themselves: no mesh is simulated.

The responses are precomputed Green's functions (James and Pai 1999, "ArtDefo"); the warp is that of Choi and Ko (2005),
"Modal warping": each node's displacement is turned by the mean of the rotations that lead up to its own.
"""

from functools import reduce

import numpy as np

from palpate.benchmark.database import Database
from palpate.bodies.contacts import row_of
from palpate.bodies.mesh import TetMesh
from palpate.models.enrichment.rotation_vectors import NodalSpins, turn, warp
from palpate.solvers.compliance import Compliance


class WarpedResponse:
    """u = R̃(w) C f', with the rotation vectors w of C f', and the force f' turned back by the contact's rotation.

    R̃(w) is the mean of the rotations by t w, 0 ≤ t ≤ 1; the contact's rotation is that of C f. Rotations are those of
    the fine response at the coarse nodes, interpolated. Development, on training samples of the shipped cylinder and
    liver: those of the fine surface were worse, as its dents turn farther than the material below.
    """

    def __init__(self, db: Database, compliance: Compliance):
        spins = NodalSpins(TetMesh(db.coarse_nodes, db.coarse_tetrahedra))
        self._contacts, self._columns, self._prolongation = compliance.contacts, compliance.fine, db.prolongation
        self._spins = np.array([[spins.of(u) for u in columns] for columns in compliance.restricted])

    def answer(self, contact: int, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the fine surface displacement (n, 3) [m] and the rotation vectors (n, 3) [rad] of its nodes.

        InputError for a contact that is not prepared.
        """
        return self._warped([(row_of(self._contacts, contact), contact, force)])

    def superpose(self, presses: list[tuple[int, np.ndarray]]) -> np.ndarray:
        """Return the fine surface displacement (n, 3) [m] under forces (3,) [N], each at its contact.

        Rotation vectors add up as linear responses do, and each force is turned back by the sum at its contact.
        """
        return self._warped([(row_of(self._contacts, contact), contact, force) for contact, force in presses])[0]

    def _warped(self, presses: list[tuple[int, int, np.ndarray]]) -> tuple[np.ndarray, np.ndarray]:
        """Turn the sum of the responses to forces; presses : row, contact and force of each."""
        spins, moved = [], []
        for row, contact, force in presses:
            here = reduce(np.add, [other @ self._spins[of, :, contact] for of, _, other in presses])
            local = turn(-here[None], force[None])[0]
            spins.append(np.tensordot(local, self._spins[row], 1))
            moved.append(np.tensordot(local, self._columns[row], 1))
        turned = self._prolongation @ reduce(np.add, spins)
        return warp(turned, reduce(np.add, moved)), turned
