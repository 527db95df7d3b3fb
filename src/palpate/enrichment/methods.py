"""Every way of enriching a coarse deformation, fitted on the same samples."""

from typing import Protocol

import numpy as np

from palpate.enrichment.blend import Blend, Known
from palpate.enrichment.blend_weights import KINDS
from palpate.enrichment.detail_correction import DetailCorrection
from palpate.enrichment.feature_vectors import kinds
from palpate.enrichment.interpolation import Interpolation
from palpate.enrichment.linear_fem import LinearFem
from palpate.enrichment.pod_rbf import PodRbf
from palpate.enrichment.ridge import KernelRidgeDetail, RidgeUpsampling
from palpate.enrichment.training_samples import FitOptions, gather
from palpate.samples.database import Database
from palpate.solvers.compliance import Compliance


class Method(Protocol):
    """What every method offers; ``sigma_m`` is its kernel width [m], NaN if it has none."""

    sigma_m: float

    def predict(self, coarse: np.ndarray, contact: int, force: np.ndarray) -> np.ndarray:
        """Fine surface displacement (n, 3) [m] from that of all coarse nodes (N, 3) [m], force (3,) [N]."""


def build(
    db: Database, compliance: Compliance, train: np.ndarray, protocol: str, options: FitOptions
) -> dict[str, Method]:
    """Fit every method on the samples ``train`` of one protocol; the names and order are those of the tables.

    compliance : linear responses of the fine and coarse meshes, for the methods that use physics
    """
    training = gather(db, train, protocol, options)
    methods: dict[str, Method] = {}
    for name, features in kinds(db, options.neighbours).items():
        known = Known(features, training, options)
        for kind in KINDS:
            methods[f"{name}_{kind}"] = Blend(known, kind, known.choose_sigma(kind))
    methods["interpolation"] = Interpolation(db)
    methods["ridge_upsampling"] = RidgeUpsampling(db, training)
    methods["kernel_ridge_detail"] = KernelRidgeDetail(db, training, options)
    methods["pod_rbf"] = PodRbf(db, training)
    methods["linear_fem"] = LinearFem(compliance)
    methods["detail_correction_unturned"] = DetailCorrection(db, compliance, protocol, turned=False)
    methods["detail_correction_untaught"] = DetailCorrection(db, compliance, protocol)
    methods["detail_correction"] = DetailCorrection(db, compliance, protocol).learn(training, options)
    return methods
