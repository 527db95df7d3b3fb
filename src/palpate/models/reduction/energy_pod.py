"""Proper orthogonal decomposition of displacements in the energy that they take from rest."""

from collections.abc import Sequence

import numpy as np

from palpate.models.reduction.columns import DEPENDENT
from palpate.models.reduction.elements_at_rest import ElementsAtRest


def energy_pod(elements: ElementsAtRest, answers: Sequence[np.ndarray], count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return mixes (s, r) of s ``answers`` (n, 3) [m] that make modes, and the coordinates (r, s) of these answers.

    Σ answer · mix are the modes: the stiffness at rest is the identity in them, and no other r ≤ ``count`` modes hold
    more of the answers' energy, each answer by itself over its own (method of snapshots, Sirovich 1987). Answers that
    depend on others, to DEPENDENT, make none.
    """
    flat = np.array([answer.ravel() for answer in answers])
    stiff = np.array([elements.multiply(np.ascontiguousarray(answer)).ravel() for answer in answers])
    products = flat @ stiff.T
    products = 0.5 * (products + products.T)
    size = np.sqrt(products.diagonal())
    values, vectors = np.linalg.eigh(products / np.outer(size, size))
    values, vectors = values[::-1][:count], vectors[:, ::-1][:, :count]
    kept = values > DEPENDENT * values[0]
    mixes = vectors[:, kept] / np.sqrt(values[kept]) / size[:, None]
    return mixes, mixes.T @ products
