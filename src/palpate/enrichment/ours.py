"""Our method: the coarse simulation corrected by the linear detail that it misses, turned with the body."""

from typing import NamedTuple

import numpy as np

from palpate.bodies.mesh import TetMesh
from palpate.enrichment.database import Database
from palpate.enrichment.gain import fit_gain
from palpate.enrichment.rotations import NodalRotations
from palpate.enrichment.training import Training
from palpate.solvers.compliance import Compliance


class Query(NamedTuple):
    """What one coarse deformation yields: interpolation and unscaled detail (n, 3) [m], and two ratios."""

    interpolated: np.ndarray
    detail: np.ndarray
    ratios: np.ndarray


class TwoLevel:
    """x_f = P x_c + s R D (R_cᵀ f): P interpolates, D is the linear response's detail, R turns each node's.

    The detail of a unit force is what the linear fine response has and interpolation from the coarse nodes
    lacks: u_fine − P C u_fine where the coarse samples are subsampled from fine ones, u_fine − P u_coarse
    where the coarse mesh is really simulated. The force is turned back by the contact's rotation R_c, the
    detail forward by each node's R. The gain s = 1 + β · (ratios − 1) is all that is learnt: two numbers β,
    on how much farther the contact moved, and how much deeper the dent around it is, than the linear coarse
    response says. Without ``turned`` all rotations are taken for the identity, and without ``learn`` the gain
    is 1: what each part is worth stands in docs/method.md.
    """

    sigma_m = np.nan

    def __init__(self, db: Database, compliance: Compliance, protocol: str, turned: bool = True):
        coarse = TetMesh(db.coarse_nodes, db.coarse_tetrahedra)
        self._prolongation = db.prolongation
        self._rotations = NodalRotations(coarse) if turned else None
        self._compliance = compliance
        self._seen = {"paper": compliance.restricted, "live": compliance.coarse}[protocol]
        interpolated = np.stack([[self._prolongation @ u for u in contact] for contact in self._seen])
        self._detail = compliance.fine - interpolated
        self._neighbours = {
            int(c): coarse.edges[(coarse.edges == c).any(axis=1)].sum(axis=1) - c for c in compliance.contacts
        }
        self.beta = np.zeros(2)

    def learn(self, training: Training) -> "TwoLevel":
        """Fit the gain to the training samples; without it the gain is 1."""
        samples = zip(training.coarse, training.contact, training.force, strict=True)
        queries = [self.query(x, int(c), f) for x, c, f in samples]
        self.beta = fit_gain(
            np.array([q.ratios for q in queries]),
            np.array([q.detail for q in queries]),
            training.fine - np.array([q.interpolated for q in queries]),
            training,
        )
        return self

    def query(self, coarse: np.ndarray, contact: int, force: np.ndarray) -> Query:
        """Interpolation, detail and ratios of one coarse deformation (N, 3) [m]."""
        row, local = self._compliance.row(contact), force
        if self._rotations:
            turned = self._rotations.at(coarse)
            local = turned[contact].T @ force
        detail = np.tensordot(local, self._detail[row], 1)
        if self._rotations:
            nodal = (self._prolongation @ turned.reshape(-1, 9)).reshape(-1, 3, 3)
            detail = (nodal @ detail[:, :, None])[:, :, 0]
        linear = np.tensordot(local, self._seen[row], 1)
        pairs = [(v[contact], v[contact] - v[self._neighbours[contact]].mean(axis=0)) for v in (coarse, linear)]
        moved, expected = np.linalg.norm(pairs, axis=2)
        ratios = np.divide(moved, expected, out=np.ones(2), where=expected > 0.0)
        return Query(self._prolongation @ coarse, detail, ratios)

    def predict(self, coarse: np.ndarray, contact: int, force: np.ndarray) -> np.ndarray:
        """Fine surface displacement (n, 3) [m] from that of all coarse nodes (N, 3) [m], force (3,) [N]."""
        query = self.query(coarse, contact, force)
        return query.interpolated + (1.0 + self.beta @ (query.ratios - 1.0)) * query.detail
