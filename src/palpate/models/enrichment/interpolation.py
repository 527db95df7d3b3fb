"""Interpolate linearly: the rival that any user has before learning anything."""

import numpy as np

from palpate.benchmark.database import Database
from palpate.models.enrichment.fit_inputs import Fitting


class Interpolation:
    """Fine displacements by the prolongation alone: one sparse product."""

    sigma_m = np.nan

    def __init__(self, db: Database):
        self._prolongation = db.prolongation

    def predict(self, coarse: np.ndarray, contact: int, force: np.ndarray) -> np.ndarray:
        """Return the fine surface displacement (n, 3) [m] from that of all coarse nodes, (N, 3) [m]."""
        return self._prolongation @ coarse


def fit(fitting: Fitting) -> Interpolation:
    """Take the meshes; nothing is learnt."""
    return Interpolation(fitting.db)
