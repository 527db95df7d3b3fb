"""Correct a coarse deformation by the linear detail that it lacks, turned with the body.

The parts are known: stored linear responses to a unit force at every node are precomputed Green's functions (James and
Pai 1999), and turning linear displacements node by node with the body is modal warping (Choi and Ko 2005). What is
fitted here is a scale and a kernel ridge on top of both. Unlike ``warped_response``, which turns the whole linear
response, this turns only what the coarse deformation lacks.
"""

from typing import NamedTuple

import numpy as np

from palpate.benchmark.database import Database
from palpate.bodies.mesh import TetMesh
from palpate.models.enrichment.detail_scale import Scale, fit_scale
from palpate.models.enrichment.fit_inputs import Fitting
from palpate.models.enrichment.node_rotations import NodalRotations
from palpate.models.enrichment.ridge import KernelRidge
from palpate.models.enrichment.training_samples import FitOptions, Training, convinces
from palpate.solvers.compliance import Compliance

FARTHEST = 1e9
"""Ratios above are of a coarse body that has left all bounds; kept finite, they leave the scale finite."""


class Query(NamedTuple):
    """The parts that one coarse deformation gives.

    interpolated, detail : (n, 3) [m], the detail with scale 1
    turned : (n, 3, 3) rotation of each fine surface node, or None if none are asked for
    ratios : (2,) how much farther the contact and its dent moved than the linear coarse response says
    """

    interpolated: np.ndarray
    detail: np.ndarray
    turned: np.ndarray | None
    ratios: np.ndarray


class DetailCorrection:
    """x_f = P x_c + R (s D (R_cᵀ f) + e): P interpolates, D is the linear response's detail, R turns each node's.

    The detail of a unit force is what the linear fine response has and interpolation from the coarse nodes
    lacks: u_fine − P C u_fine where the coarse samples are subsampled from fine ones, u_fine − P u_coarse
    where the coarse mesh is really simulated. The force is turned back by the contact's rotation R_c, the
    detail forward by each node's R. Learnt are the scale s = 1 + β · (ratios − 1) of two numbers β, which stays
    among the scales of the training samples, and the residual e by kernel ridge on the coarse displacements, if that
    helps on samples left out. Without ``turned`` the rotations are taken for the identity, and without ``learn``
    s = 1 and e = 0: docs/method.md has what each part is worth.
    """

    sigma_m = np.nan

    def __init__(self, db: Database, compliance: Compliance, protocol: str, turned: bool = True):
        coarse = TetMesh(db.coarse_nodes, db.coarse_tetrahedra)
        self._surface, self._prolongation = db.coarse_surface, db.prolongation
        self._rotations = NodalRotations(coarse) if turned else None
        self._compliance = compliance
        self._seen = {"paper": compliance.restricted, "live": compliance.coarse}[protocol]
        interpolated = np.stack([[self._prolongation @ u for u in contact] for contact in self._seen])
        self._detail = compliance.fine - interpolated
        self._neighbours = {
            int(c): coarse.edges[(coarse.edges == c).any(axis=1)].sum(axis=1) - c for c in compliance.contacts
        }
        self.scale = Scale(np.zeros(2))
        self._residual: KernelRidge | None = None

    def learn(self, training: Training, options: FitOptions) -> "DetailCorrection":
        """Fit the scale and then the residual to the training samples; only with ``turned``."""
        samples = zip(training.coarse, training.contact, training.force, strict=True)
        queries = [self._query(x, int(c), f) for x, c, f in samples]
        missing = training.fine - np.array([q.interpolated for q in queries])
        ratios, detail = np.array([q.ratios for q in queries]), np.array([q.detail for q in queries])
        self.scale = fit_scale(ratios, detail, missing, training)
        left = missing - self.scale.of(ratios)[:, None, None] * detail
        plain = np.sqrt(np.mean(np.sum(left**2, axis=2), axis=1)) / training.peaks
        turns = [q.turned.transpose(0, 2, 1) for q in queries if q.turned is not None]
        unturned = np.array([_turn(r, e) for r, e in zip(turns, left, strict=True)])
        described = training.coarse[:, self._surface].reshape(len(queries), -1)
        residual = KernelRidge(described, unturned.reshape(len(queries), -1), training, options)
        if convinces(residual.errors, plain, training.fold):
            self._residual, self.sigma_m = residual, residual.sigma_m
        return self

    def predict(self, coarse: np.ndarray, contact: int, force: np.ndarray) -> np.ndarray:
        """Return the fine surface displacement (n, 3) [m] from that of all coarse nodes (N, 3) [m], force (3,) [N]."""
        query = self._query(coarse, contact, force)
        fine = query.interpolated + self.scale.of(query.ratios) * query.detail
        if self._residual is not None and query.turned is not None:
            fine += _turn(query.turned, self._residual.predict(coarse[self._surface].ravel()))
        return fine

    def _query(self, coarse: np.ndarray, contact: int, force: np.ndarray) -> Query:
        row, local = self._compliance.row(contact), force
        if self._rotations:
            nodal = self._rotations.at(coarse)
            local = nodal[contact].T @ force
        detail = np.tensordot(local, self._detail[row], 1)
        linear = np.tensordot(local, self._seen[row], 1)
        near = self._neighbours[contact]
        pairs = [(v[contact], v[contact] - v[near].mean(axis=0)) for v in (coarse, linear)]
        with np.errstate(over="ignore"):
            moved, expected = np.linalg.norm(pairs, axis=2)
        ratios = np.minimum(np.divide(moved, expected, out=np.ones(2), where=expected > 0.0), FARTHEST)
        turned = None
        if self._rotations:
            turned = (self._prolongation @ nodal.reshape(-1, 9)).reshape(-1, 3, 3)
            detail = _turn(turned, detail)
        return Query(self._prolongation @ coarse, detail, turned, ratios)


def _turn(rotations: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Turn each vector (n, 3) by its rotation (n, 3, 3)."""
    return (rotations @ vectors[:, :, None])[:, :, 0]


def fit(fitting: Fitting, turned: bool = True, learnt: bool = True) -> DetailCorrection:
    """Take the detail from the linear responses, and with ``learnt`` fit scale and residual."""
    method = DetailCorrection(fitting.db, fitting.linear(), fitting.protocol, turned)
    return method.learn(fitting.training, fitting.options) if learnt else method
