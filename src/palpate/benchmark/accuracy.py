"""Measure the error of a prediction."""

from typing import NamedTuple, Protocol

import numpy as np

from palpate.bodies.mesh import Mesh
from palpate.errors import InputError


class Errors(NamedTuple):
    """Error of one prediction over the fine surface nodes; "of peak" is relative to the reference's peak.

    rmse_m : root of the mean over nodes of the squared length of the error vector [m]
    p95_of_peak, max_of_peak : 95th percentile and largest over nodes of the length of the error vector
    """

    rmse_m: float
    rmse_of_peak: float
    p95_of_peak: float
    max_of_peak: float


class TruthErrors(NamedTuple):
    """Error of one prediction against the truth, over the fine surface nodes; "of peak" is relative to its peak.

    rmse_m, rmse_of_peak, p95_of_peak, max_of_peak : as in ``Errors``
    relative_l2 : RMS error over RMS displacement, on the same nodes
    patch_rms_of_peak, patch_max_of_peak : RMS and largest length of the error vector over the nodes that are pressed
    """

    rmse_m: float
    rmse_of_peak: float
    relative_l2: float
    p95_of_peak: float
    max_of_peak: float
    patch_rms_of_peak: float
    patch_max_of_peak: float


def errors(predicted: np.ndarray, reference: np.ndarray) -> Errors:
    """Measure a predicted displacement (n, 3) [m] against the simulated one, (n, 3) [m].

    Raises InputError if the reference moves nowhere: there is no peak to compare with.
    """
    peak = np.linalg.norm(reference, axis=1).max()
    if peak == 0:
        raise InputError("accuracy: the reference moves nowhere; leave samples without a force out.")
    error = np.linalg.norm(predicted - reference, axis=1)
    rmse = np.sqrt(np.mean(error**2))
    return Errors(float(rmse), float(rmse / peak), float(np.percentile(error, 95) / peak), float(error.max() / peak))


def truth_errors(predicted: np.ndarray, truth: np.ndarray, patch: np.ndarray) -> TruthErrors:
    """Measure a predicted displacement (n, 3) [m] of the fine surface against the true one, (n, 3) [m].

    patch : (n,) bool, the nodes that are pressed, as ``patch_nodes`` gives them
    Raises InputError if the truth moves nowhere.
    """
    basic, error = errors(predicted, truth), np.linalg.norm(predicted - truth, axis=1)
    peak = np.linalg.norm(truth, axis=1).max()
    return TruthErrors(
        **basic._asdict(),
        relative_l2=float(np.linalg.norm(error) / np.linalg.norm(truth)),
        patch_rms_of_peak=float(np.sqrt(np.mean(error[patch] ** 2)) / peak),
        patch_max_of_peak=float(error[patch].max() / peak),
    )


def patch_nodes(mesh: Mesh, contact: int, radius_m: float) -> np.ndarray:
    """Mark the surface nodes of ``mesh`` in the disc of ``radius_m`` [m] around node ``contact``: (n_surface,) bool.

    Those that face away, as on the other side of a thin lobe, are not in it. The contact itself always is.
    """
    surface = mesh.surface
    near = np.linalg.norm(mesh.nodes[surface] - mesh.nodes[contact], axis=1) <= radius_m
    return (near & (mesh.normals[surface] @ mesh.normals[contact] > 0.0)) | (surface == contact)


class Method(Protocol):
    """A fitted method; ``sigma_m`` is its kernel width [m], NaN if it has none."""

    sigma_m: float

    def predict(self, coarse: np.ndarray, contact: int, force: np.ndarray) -> np.ndarray:
        """Return the fine surface displacement (n, 3) [m] from that of all coarse nodes (N, 3) [m], force (3,) [N]."""
