"""Correct a coarse deformation by the linear detail that it lacks, turned with the body, and by a learnt residual.

Stored linear responses to a unit force at every node are precomputed Green's functions (James and Pai 1999), and
turning linear displacements node by node with the body is modal warping (Choi and Ko 2005). A scale and a kernel ridge
are fitted on top of both. Unlike ``warped_compliance``, which turns the whole linear response, this turns the detail
only: a two-level correction.
"""

from typing import NamedTuple

import numba
import numpy as np

from palpate.benchmark.accuracy import Method
from palpate.benchmark.database import Database
from palpate.benchmark.model import Case, Solver
from palpate.bodies.mesh import TetMesh
from palpate.effects.elements import shape_gradients
from palpate.linalg.polar import signed_svd
from palpate.models import kinds
from palpate.models.coarse_answers import Enriched, coarse_solver, seen_with, training_of
from palpate.models.enrichment.ridge import KernelRidge
from palpate.models.enrichment.training_samples import Training, convinces
from palpate.models.limit import ToLimit
from palpate.solvers.compliance import Compliance


class NodalRotations:
    """Rotations of a mesh's nodes: the polar part of the volume-weighted mean deformation gradient around each."""

    def __init__(self, mesh: TetMesh):
        self._tetrahedra = np.ascontiguousarray(mesh.tetrahedra)
        self._gradients, self._volumes = shape_gradients(mesh)

    def at(self, displacement: np.ndarray) -> np.ndarray:
        """Return rotations (n_nodes, 3, 3) for a ``displacement`` (n_nodes, 3) [m]."""
        means = np.zeros((len(displacement), 3, 3))
        _nodal_rotations(displacement, self._tetrahedra, self._gradients, self._volumes, means)
        return means


@numba.njit(cache=True)
def _nodal_rotations(displacement, tetrahedra, gradients, volumes, means):
    """Write the rotation of the volume-weighted mean deformation gradient around each node into ``means`` (n, 3, 3)."""
    u, v, s = np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    f = np.empty((3, 3))
    for e in range(len(tetrahedra)):
        for i in range(3):
            for j in range(3):
                f[i, j] = volumes[e] if i == j else 0.0  # volume times deformation gradient
                for a in range(4):
                    f[i, j] += volumes[e] * displacement[tetrahedra[e, a], i] * gradients[e, a, j]
        for a in range(4):
            means[tetrahedra[e, a]] += f
    for n in range(len(means)):
        signed_svd(means[n], u, s, v)
        for i in range(3):
            for j in range(3):
                means[n, i, j] = u[i, 0] * v[j, 0] + u[i, 1] * v[j, 1] + u[i, 2] * v[j, 2]


PENALTIES = np.geomspace(1e-6, 1e2, 17)
"""The ridge penalties tried, relative to the mean square of the regressors; the scale 1 is tried too."""


class Scale(NamedTuple):
    """The scale 1 + β · (ratios − 1), with two numbers ``beta`` (2,), clipped to ``low`` and ``high``."""

    beta: np.ndarray
    low: float = -np.inf
    high: float = np.inf

    def of(self, ratios: np.ndarray) -> np.ndarray:
        """Return the scale of each row of ``ratios`` (..., 2)."""
        return np.clip(1.0 + (ratios - 1.0) @ self.beta, self.low, self.high)


def fit_scale(ratios: np.ndarray, detail: np.ndarray, missing: np.ndarray, training: Training) -> Scale:
    """Return the scale with which ``detail`` fits best what interpolation is ``missing``.

    ratios : (k, 2); detail, missing : (k, n, 3) [m]
    Samples count by the square of their relative error. Cross-validation over the training folds, which hold out
    contacts if the split does, chooses the ridge's penalty, whether the scale is clipped to those of the samples, and
    whether it is 1 instead.
    """
    peaks = training.db.peaks
    detail_square = _inner(detail, detail) / peaks**2
    missing_by_detail = _inner(missing - detail, detail) / peaks**2
    unexplained = _inner(missing - detail, missing - detail) / peaks**2

    def solve(samples: np.ndarray, penalty: float, bounded: bool) -> Scale:
        """Fit the scale 1 + β · (ratios − 1) of the detail by ridge regression; ``bounded`` by those of the samples."""
        regressors = ratios[samples] - 1.0
        normal = regressors.T @ (regressors * detail_square[samples, None])
        if not normal.trace() > 0.0:
            return Scale(np.zeros(2))
        ridge = penalty * normal.trace() * np.eye(2)
        fitted = Scale(np.linalg.solve(normal + ridge, regressors.T @ missing_by_detail[samples]))
        scales = fitted.of(ratios[samples])
        return Scale(fitted.beta, float(scales.min()), float(scales.max())) if bounded else fitted

    def error(samples: np.ndarray, scale: Scale) -> float:
        extra = scale.of(ratios[samples]) - 1.0  # of the detail, beside its scale of 1
        squared = unexplained[samples] - 2.0 * extra * missing_by_detail[samples] + extra**2 * detail_square[samples]
        return float(np.sqrt(np.maximum(squared, 0.0)).sum())

    candidates = [(penalty, bounded) for bounded in (True, False) for penalty in PENALTIES]
    scores = [sum(error(held_out, solve(learnt, *each)) for learnt, held_out in training.folds) for each in candidates]
    everything = np.arange(len(ratios))
    if min(scores) >= error(everything, Scale(np.zeros(2))):
        return Scale(np.zeros(2))
    return solve(everything, *candidates[int(np.argmin(scores))])


def _inner(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("kni,kni->k", a, b)


FARTHEST = 1e9  # ratios above are of a coarse body that has left all bounds; kept finite, they leave the scale finite


class Query(NamedTuple):
    """What one coarse deformation gives for its fine answer.

    interpolated, detail : (n, 3) [m], the detail with scale 1
    turned : (n, 3, 3) rotation of each fine surface node, or None if none are asked for
    ratios : (2,) displacements of the contact and of its dent, over those of the linear coarse response
    """

    interpolated: np.ndarray
    detail: np.ndarray
    turned: np.ndarray | None
    ratios: np.ndarray


class DetailCorrection(Method):
    """x_f = P x_c + R (s D (R_cᵀ f) + e): P interpolates, D is the linear response's detail, R turns each node's.

    The detail of a unit force is what the linear fine response has and interpolation from the coarse nodes
    lacks: u_fine − P C u_fine where the coarse samples are subsampled from fine ones, u_fine − P u_coarse
    where the coarse mesh is really simulated. The force is turned back by the contact's rotation R_c, the
    detail forward by each node's R. Learnt are the scale s = 1 + β · (ratios − 1) of two numbers β, which stays
    among the scales of the training samples, and the residual e by kernel ridge on the coarse displacements, if that
    helps on samples left out. Without ``turned`` the rotations are taken for the identity, and without ``learn``
    s = 1 and e = 0: docs/method.md has what each part is worth.
    """

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

    def learn(self, training: Training) -> "DetailCorrection":
        """Fit the scale, then the residual, to training samples; only of a correction that is ``turned``."""
        db = training.db
        samples = zip(training.coarse, db.contact.tolist(), db.force, strict=True)
        queries = [self._query(*sample) for sample in samples]
        missing = db.fine - np.array([q.interpolated for q in queries])
        ratios, detail = np.array([q.ratios for q in queries]), np.array([q.detail for q in queries])
        self.scale = fit_scale(ratios, detail, missing, training)
        residual = missing - self.scale.of(ratios)[:, None, None] * detail
        plain_errors = np.sqrt(np.mean(np.sum(residual**2, axis=2), axis=1)) / db.peaks
        turns_back = [q.turned.transpose(0, 2, 1) for q in queries if q.turned is not None]
        unturned = np.array([_turn(*pair).ravel() for pair in zip(turns_back, residual, strict=True)])
        learnt = KernelRidge(training.described, unturned, training)
        if convinces(learnt.errors, plain_errors, training.fold):
            self._residual, self.sigma_m = learnt, learnt.sigma_m
        return self

    def predict(self, coarse: np.ndarray, contact: int, force: np.ndarray) -> np.ndarray:
        query = self._query(coarse, contact, force)
        fine = query.interpolated + self.scale.of(query.ratios) * query.detail
        if self._residual is not None and query.turned is not None:
            fine += _turn(query.turned, self._residual.predict(coarse[self._surface].ravel()))
        return fine

    def _query(self, coarse: np.ndarray, contact: int, force: np.ndarray) -> Query:
        """Return the parts of a fine answer for the displacement ``coarse`` (N, 3) [m] of all coarse nodes."""
        row, turned_back = self._compliance.row(contact), force
        if self._rotations:
            nodal = self._rotations.at(coarse)
            turned_back = nodal[contact].T @ force
        detail = np.tensordot(turned_back, self._detail[row], 1)
        linear_coarse = np.tensordot(turned_back, self._seen[row], 1)
        neighbours = self._neighbours[contact]
        pairs = [(v[contact], v[contact] - v[neighbours].mean(axis=0)) for v in (coarse, linear_coarse)]
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


def fit(training: Training, turned: bool = True, learnt: bool = True) -> DetailCorrection:
    method = DetailCorrection(training.db, training.linear(), training.protocol, turned)
    return method.learn(training) if learnt else method


def prepare(case: Case, model: kinds.DetailCorrection) -> Solver:
    """Compute the detail of every contact, and fit scale and residual to coarse answers such as queries will get."""
    coarse = coarse_solver(case, model.coarse)
    method = DetailCorrection(case.meshes, case.use_compliance(), "live", model.turned)
    if model.samples != 0:
        method.learn(training_of(seen_with(case, model.coarse, coarse).first(model.samples)))
    solver = Enriched(method, coarse)
    return ToLimit(case, solver, case.use_compliance().fine) if model.target else solver
