"""Regress linearly as section 3.2 of paper 1 begins: (XcᵀXc)⁻¹ stands in the place of A, and Xcᵀx in that of w."""

import numpy as np

from palpate.models.enrichment.blend_weights import inverse
from palpate.models.enrichment.feature_vectors import describe, in_slots, kinds
from palpate.models.enrichment.fit_inputs import Fitting


class LinearRegressor:
    """x_f = Xf (XcᵀXc)⁻¹ Xcᵀ x_c: the linear map of least norm through all training samples, without any σ.

    Weights are not normalised, so that a press twice as hard is answered by twice the displacement. With more samples
    than numbers in a feature vector XcᵀXc is singular, and its pseudoinverse gives the map of least squares.
    """

    sigma_m = np.nan

    def __init__(self, fitting: Fitting, features: str):
        training = fitting.training
        self._features = kinds(fitting.db, fitting.options.neighbours)[features]
        self._described = describe(self._features, training.contact, training.coarse)
        slots = in_slots(self._features, training.contact, training.fine)
        self._dual = inverse(self._described @ self._described.T) @ slots

    def predict(self, coarse: np.ndarray, contact: int, force: np.ndarray) -> np.ndarray:
        """Return the fine surface displacement (n, 3) [m] from that of all coarse nodes, (N, 3) [m]."""
        view = self._features.view(contact)
        return view.from_slots((self._described @ view.feature(coarse)) @ self._dual)


def fit(fitting: Fitting, features: str) -> LinearRegressor:
    """Fit the linear map between one kind of feature and the fine displacements in its order."""
    return LinearRegressor(fitting, features)
