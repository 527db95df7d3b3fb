"""Displacements that a contact's answers are made of: linear responses, and what they cause to second order."""

import numpy as np

from palpate.models.reduction.elements_at_rest import ElementsAtRest

LINEAR, SECOND = 1e-5, 3e-2
"""Relative residuals of the linear columns, and of those of second order, which are themselves corrections."""
STEP = 0.01
"""Largest displacement of the differences, over the body's size."""
DEPENDENT = 1e-9
"""Eigenvalues of the columns' products below this part of the largest are of columns that are not independent."""
PAIRS = [(i, j) for i in range(3) for j in range(i, 3)]


def linear_columns(elements: ElementsAtRest, nodes: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """Return responses (n, 3, 3) [m/N] to unit forces along x, y, z on ``nodes`` (k,) by ``shares`` (k,)."""
    return elements.solve(elements.nodal(nodes, shares, np.eye(3)), LINEAR)


def second_columns(elements: ElementsAtRest, linear: np.ndarray, other: np.ndarray | None = None) -> np.ndarray:
    """Return static derivatives (n, 3, 6) of the columns ``linear`` (n, 3, 3) [m/N], each of which is taken to STEP.

    −K⁻¹ ∂²f[φᵢ, φⱼ], f the elastic force, by central differences (Idelsohn and Cardona 1985; Barbič and James 2005).
    With ``other`` columns (n, 3, 3) of another contact the nine that join one of either.
    """
    first, second = (STEP * elements.size * _unit(each) for each in (linear, linear if other is None else other))
    pairs = PAIRS if other is None else [(i, j) for i in range(3) for j in range(3)]

    def bend(moved: np.ndarray) -> np.ndarray:
        return elements.force(moved) + elements.force(-moved)

    one = [bend(first[:, :, i]) for i in range(3)]
    two = one if other is None else [bend(second[:, :, i]) for i in range(3)]
    pulls = [
        one[i] if other is None and i == j else bend(first[:, :, i] + second[:, :, j]) - one[i] - two[j]
        for i, j in pairs
    ]  # f is minus the gradient, so that it stands on the right side as it is
    return elements.solve(np.stack(pulls, axis=2), SECOND)


def _unit(columns: np.ndarray) -> np.ndarray:
    """Return ``columns`` (n, 3, k) over the largest displacement of each."""
    return columns / np.linalg.norm(columns, axis=1).max(axis=0)


def orthonormal(elements: ElementsAtRest, columns: np.ndarray) -> np.ndarray:
    """Return a basis (n, 3, r) of ``columns`` (n, 3, k) in which the stiffness at rest is the identity; r ≤ k.

    Columns are made of the same energy before, and what is dependent to DEPENDENT is left out.
    """
    flat = columns.reshape(-1, columns.shape[2])
    stiff = elements.multiply(np.ascontiguousarray(columns)).reshape(flat.shape)
    size = np.sqrt(np.einsum("ik,ik->k", flat, stiff))
    flat, stiff = flat[:, size > 0.0] / size[size > 0.0], stiff[:, size > 0.0] / size[size > 0.0]
    values, vectors = np.linalg.eigh(flat.T @ stiff)
    kept = values > DEPENDENT * values[-1]
    return (flat @ (vectors[:, kept] / np.sqrt(values[kept]))).reshape(*columns.shape[:2], -1)
