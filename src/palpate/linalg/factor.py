"""Direct solution of a symmetric sparse system, factorised once."""

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu


class Factor:
    """Sparse LU without pivoting of a symmetric matrix of 3 × 3 blocks; ValueError if it is singular."""

    def __init__(self, matrix: sparse.bsr_array):
        try:
            self._lu = splu(
                matrix.tocsc(),
                permc_spec="MMD_AT_PLUS_A",
                diag_pivot_thresh=0.0,
                options={"SymmetricMode": True},
            )
        except RuntimeError as error:
            raise ValueError("the stiffness matrix is singular") from error

    def solve(self, right: np.ndarray) -> np.ndarray:
        """Solve for one right side (n, 3), or for k at once (n, 3, k)."""
        flat = right.reshape(3 * len(right), *right.shape[2:])
        return np.ascontiguousarray(self._lu.solve(flat)).reshape(right.shape)
