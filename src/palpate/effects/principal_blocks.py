"""From derivatives in the frame of the principal stretches to the blocks of a Hessian.

F is a sum Σ d_c g_cᵀ over three fixed vectors g_c, the gradients of an element's shape functions at its second to
fourth corner. A Hessian here is that of the energy with respect to the three d_c, in six blocks of 3 × 3: those of the
pairs PAIRS, as rows 9 p to 9 p + 8 of an array (54, BLOCK) whose columns are the deformation gradients.
"""

import numba
import numpy as np

PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
"""The pairs of gradients whose blocks are kept; the others are transposes."""


@numba.njit(cache=True, error_model="numpy")
def write_blocks(u, v, curvatures, flips, twists, gradients, share, k, h, b, blocks):
    """Write column ``k`` of ``blocks``; ``share`` is its volume [m³], ``h, b`` (3, 3) are scratch.

    With h = Vᵀ g the block of g and g' is V U b Uᵀ, where bᵢⱼ = ∂²Ψ/∂sᵢ∂sⱼ hᵢ h'ⱼ on and off the diagonal, and each
    pair of axes (i, j) adds (flip + twist)/2 hⱼ h'ⱼ to bᵢᵢ and (flip − twist)/2 hⱼ h'ᵢ to bᵢⱼ.
    """
    for c in range(3):
        for i in range(3):
            h[c, i] = (
                gradients[3 * c, k] * v[0, i] + gradients[3 * c + 1, k] * v[1, i] + gradients[3 * c + 2, k] * v[2, i]
            )
    for pair in range(6):
        c, d = PAIRS[pair]
        for i in range(3):
            for j in range(3):
                b[i, j] = share * curvatures[i, j] * h[c, i] * h[d, j]
        for axis in range(3):
            i, j = (axis + 1) % 3, (axis + 2) % 3
            same = 0.5 * share * (flips[axis] + twists[axis])
            other = 0.5 * share * (flips[axis] - twists[axis])
            b[i, i] += same * h[c, j] * h[d, j]
            b[j, j] += same * h[c, i] * h[d, i]
            b[i, j] += other * h[c, j] * h[d, i]
            b[j, i] += other * h[c, i] * h[d, j]
        for i in range(3):
            b0 = u[i, 0] * b[0, 0] + u[i, 1] * b[1, 0] + u[i, 2] * b[2, 0]
            b1 = u[i, 0] * b[0, 1] + u[i, 1] * b[1, 1] + u[i, 2] * b[2, 1]
            b2 = u[i, 0] * b[0, 2] + u[i, 1] * b[1, 2] + u[i, 2] * b[2, 2]
            for j in range(3):
                blocks[9 * pair + 3 * i + j, k] = b0 * u[j, 0] + b1 * u[j, 1] + b2 * u[j, 2]


@numba.njit(cache=True, error_model="numpy")
def clamp(curvatures, flips, twists):
    """Replace the negative eigenvalues of what a Hessian consists of by zero, in place."""
    values, vectors = np.linalg.eigh(curvatures)
    curvatures[:] = (vectors * np.maximum(values, 0.0)) @ vectors.T
    clamp_pairs(flips, twists)


@numba.njit(cache=True, error_model="numpy")
def clamp_pairs(flips, twists):
    """Replace negative ``flips`` and ``twists`` by zero, in place."""
    for axis in range(3):
        flips[axis], twists[axis] = max(flips[axis], 0.0), max(twists[axis], 0.0)
