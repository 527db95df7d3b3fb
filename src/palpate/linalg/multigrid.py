"""Geometric multigrid on nested meshes, its Gauss–Seidel sweeps and its direct solver: linear in the number of nodes.

Sweeps go over the 3 × 3 blocks of a symmetric matrix, of which only the lower triangle is kept and read. What a sweep
has found at a node goes at once to the nodes before it, with the same blocks that it was found with, so that a sweep
and the residual after it read each block once; memory, and not arithmetic, is what a sweep waits for.
It preconditions conjugate gradients, which detect a matrix that is not positive definite, and check what they found.
"""

from collections.abc import Callable
from dataclasses import replace

import numba
import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from palpate.errors import NotConverged
from palpate.linalg.block_pattern import BlockPattern, add_block, hold


class Factor:
    """Sparse LU without pivoting of a symmetric matrix of 3 × 3 blocks; ValueError if it is singular."""

    def __init__(self, matrix: sparse.bsr_array):
        try:
            self._lu = splu(
                matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
            )
        except RuntimeError as error:
            raise ValueError("the stiffness matrix is singular") from error

    def solve(self, right: np.ndarray) -> np.ndarray:
        """Solve for one right side (n, 3), or for k at once (n, 3, k)."""
        flat = right.reshape(3 * len(right), *right.shape[2:])
        return np.ascontiguousarray(self._lu.solve(flat)).reshape(right.shape)


class Triangle:
    """The blocks below the diagonal of a pattern, row by row.

    indptr (n + 1,), indices (k,) : rows and columns of these blocks, as in ``scipy.sparse.bsr_array``
    places (k,), diagonal (n,) : positions in the pattern of these blocks and of the diagonal ones
    Numbers are unsigned, as compiled code asks of each signed one whether it counts from the end.
    """

    def __init__(self, pattern: BlockPattern):
        rows = np.repeat(np.arange(pattern.size, dtype=np.int32), np.diff(pattern.indptr))
        self.places = np.flatnonzero(pattern.indices < rows).astype(np.int32)
        self.indices = pattern.indices[self.places].astype(np.uint32)
        counts = np.bincount(rows[self.places], minlength=pattern.size)
        self.indptr = np.concatenate([[0], np.cumsum(counts)]).astype(np.uint32)
        self.diagonal = pattern.diagonal


class Sweeps:
    """Gauss–Seidel sweeps over the nodes: forward from zero, then backward after a correction by a coarser level.

    Both together are a symmetric linear map of the right side if the correction is one of the residual.
    values (n_blocks, 3, 3) : the blocks of the symmetric matrix, in the pattern of ``where``
    """

    def __init__(self, where: Triangle, values: np.ndarray):
        self._arrays = (where.indptr, where.indices, values[where.places], _inverses(values, where.diagonal))

    def forward(self, right: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Sweep from zero for ``right`` (n, 3), or k at once (n, 3, k); return x and the residual that it leaves."""
        x, residual = np.empty_like(right), np.zeros_like(right)
        (_forward if right.ndim == 2 else _forward_sides)(*self._arrays, right, x, residual)
        return x, residual

    def backward(self, x: np.ndarray, correction: np.ndarray) -> np.ndarray:
        """Sweep backward from ``x`` + ``correction``, of one shape, where ``x`` is what ``forward`` returned; in place.

        As the forward sweep solved D x + L x = right for the diagonal D and the lower blocks L, the right side is not
        needed: what is left for a node is the lower blocks' product with the correction, and the upper ones' with x.
        """
        (_backward if x.ndim == 2 else _backward_sides)(*self._arrays, correction, np.zeros_like(x), x)
        return x


@numba.njit(cache=True, error_model="numpy")
def _inverses(values, diagonal):
    """Return the inverses (n, 3, 3) of the blocks of ``values`` (n_blocks, 3, 3) at positions ``diagonal`` (n,)."""
    inverses = np.empty((len(diagonal), 3, 3))
    for n in range(len(diagonal)):
        block, inverse = values[diagonal[n]], inverses[n]
        for i in range(3):
            for j in range(3):  # the cofactor of entry j, i
                k, m, p, q = (j + 1) % 3, (j + 2) % 3, (i + 1) % 3, (i + 2) % 3
                inverse[i, j] = block[k, p] * block[m, q] - block[k, q] * block[m, p]
        det = block[0, 0] * inverse[0, 0] + block[0, 1] * inverse[1, 0] + block[0, 2] * inverse[2, 0]
        for i in range(3):
            for j in range(3):
                inverse[i, j] /= det
    return inverses


@numba.njit(cache=True)
def _forward(indptr, indices, lower, inverses, right, x, residual):
    """Sweep forward from zero: write ``x`` (n, 3), and add what it leaves to ``residual`` (n, 3), zero at first."""
    for i in range(np.uint64(len(right))):
        y0, y1, y2 = 0.0, 0.0, 0.0
        for k in range(indptr[i], indptr[i + 1]):
            j, m = indices[k], lower[k]
            a, b, c = x[j, 0], x[j, 1], x[j, 2]
            y0 += m[0, 0] * a + m[0, 1] * b + m[0, 2] * c
            y1 += m[1, 0] * a + m[1, 1] * b + m[1, 2] * c
            y2 += m[2, 0] * a + m[2, 1] * b + m[2, 2] * c
        r0, r1, r2 = right[i, 0] - y0, right[i, 1] - y1, right[i, 2] - y2
        a, b, c = _times(inverses[i], r0, r1, r2)
        x[i, 0], x[i, 1], x[i, 2] = a, b, c
        for k in range(indptr[i], indptr[i + 1]):
            j, m = indices[k], lower[k]
            residual[j, 0] -= m[0, 0] * a + m[1, 0] * b + m[2, 0] * c
            residual[j, 1] -= m[0, 1] * a + m[1, 1] * b + m[2, 1] * c
            residual[j, 2] -= m[0, 2] * a + m[1, 2] * b + m[2, 2] * c


@numba.njit(cache=True)
def _backward(indptr, indices, lower, inverses, correction, upper, x):
    """Sweep backward over the nodes, changing ``x`` (n, 3) in place.

    upper : (n, 3), zero at first; gathers the products of the upper blocks in each row
    Blocks are read strictly backwards, so that the processor fetches them ahead.
    """
    n = np.uint64(len(x))
    for done in range(n):
        i = n - np.uint64(1) - done
        last_block, count = indptr[i + 1] - np.uint32(1), indptr[i + 1] - indptr[i]
        y0, y1, y2 = 0.0, 0.0, 0.0
        for k in range(count):
            j, m = indices[last_block - k], lower[last_block - k]
            a, b, c = correction[j, 0], correction[j, 1], correction[j, 2]
            y0 += m[0, 0] * a + m[0, 1] * b + m[0, 2] * c
            y1 += m[1, 0] * a + m[1, 1] * b + m[1, 2] * c
            y2 += m[2, 0] * a + m[2, 1] * b + m[2, 2] * c
        a, b, c = _times(inverses[i], upper[i, 0] + y0, upper[i, 1] + y1, upper[i, 2] + y2)
        a, b, c = x[i, 0] - a, x[i, 1] - b, x[i, 2] - c
        x[i, 0], x[i, 1], x[i, 2] = a, b, c
        for k in range(count):
            j, m = indices[last_block - k], lower[last_block - k]
            upper[j, 0] += m[0, 0] * a + m[1, 0] * b + m[2, 0] * c
            upper[j, 1] += m[0, 1] * a + m[1, 1] * b + m[2, 1] * c
            upper[j, 2] += m[0, 2] * a + m[1, 2] * b + m[2, 2] * c


@numba.njit(cache=True, inline="always")
def _times(block, a, b, c):
    return (
        block[0, 0] * a + block[0, 1] * b + block[0, 2] * c,
        block[1, 0] * a + block[1, 1] * b + block[1, 2] * c,
        block[2, 0] * a + block[2, 1] * b + block[2, 2] * c,
    )


@numba.njit(cache=True)
def _forward_sides(indptr, indices, lower, inverses, right, x, residual):
    """Do as ``_forward`` does for k right sides (n, 3, k)."""
    total = np.empty(right.shape[1:])
    for i in range(len(right)):
        _copy(-1.0, right[i], total)
        for k in range(indptr[i], indptr[i + 1]):
            add_block(lower[k], x[indices[k]], total)
        _copy(-1.0, total, total)
        x[i] = 0.0
        add_block(inverses[i], total, x[i])
        _copy(-1.0, x[i], total)
        for k in range(indptr[i], indptr[i + 1]):
            add_block(lower[k].T, total, residual[indices[k]])


@numba.njit(cache=True)
def _backward_sides(indptr, indices, lower, inverses, correction, upper, x):
    """Do as ``_backward`` does for k right sides (n, 3, k)."""
    total = np.empty(x.shape[1:])
    for i in range(len(x) - 1, -1, -1):
        last_block, count = indptr[i + 1] - np.uint32(1), indptr[i + 1] - indptr[i]
        _copy(1.0, upper[i], total)
        for k in range(count):
            add_block(lower[last_block - k], correction[indices[last_block - k]], total)
        _copy(-1.0, total, total)
        add_block(inverses[i], total, x[i])
        for k in range(count):
            add_block(lower[last_block - k].T, x[i], upper[indices[last_block - k]])


@numba.njit(cache=True, inline="always")
def _copy(factor, source, target):
    """Set ``target`` (3, k) to ``factor`` times ``source`` (3, k), without an array in between."""
    for p in range(3):
        for s in range(source.shape[1]):
            target[p, s] = factor * source[p, s]


class Multigrid:
    """A symmetric V-cycle: Gauss–Seidel over nodes, Galerkin coarse matrices, a direct solve on the coarsest level.

    patterns : block pattern of each level, coarse first
    prolongations : (n_finer, n_coarser) sparse between neighbours, with at most two entries a row
    held : (n,) bool for each level
    """

    def __init__(self, patterns: list[BlockPattern], prolongations: list[sparse.csr_array], held: list[np.ndarray]):
        self.patterns = [replace(pattern, slots=()) for pattern in patterns]  # slots are large, and not needed here
        self.held = held
        self._parents = [_parents(p) for p in prolongations]
        self._triangles = [Triangle(pattern) for pattern in patterns[1:]]
        self._slots = [
            _find_slots(finer.indptr, finer.indices, parents, coarser.indptr, coarser.indices)
            for finer, coarser, (parents, _) in zip(patterns[1:], patterns, self._parents, strict=False)
        ]

    def update(self, stiffness: sparse.bsr_array) -> None:
        """Set the fine matrix, symmetric and with the identity's rows for held nodes; ValueError if it is singular."""
        values = self.galerkin(stiffness)
        self._sweeps = [Sweeps(triangle, blocks) for triangle, blocks in zip(self._triangles, values[1:], strict=True)]
        self._bottom = Factor(self.patterns[0].matrix(values[0]))

    def galerkin(self, stiffness: sparse.bsr_array) -> list[np.ndarray]:
        """Return the blocks (n_blocks, 3, 3) of the matrix of each level, coarse first, from the fine matrix."""
        values = [stiffness.data]
        for level in range(len(self.patterns) - 2, -1, -1):
            coarse = np.zeros((len(self.patterns[level].indices), 3, 3))
            _, weights = self._parents[level]
            pattern = self.patterns[level + 1]
            _galerkin(pattern.indptr, pattern.indices, values[0], weights, self._slots[level], coarse)
            hold(self.patterns[level].indptr, self.patterns[level].indices, coarse, self.held[level])
            values.insert(0, coarse)
        return values

    def solve(self, right: np.ndarray) -> np.ndarray:
        """Apply one V-cycle from zero to the right side (n, 3), or to k at once (n, 3, k): a symmetric linear map."""
        return self._cycle(len(self.patterns) - 1, right)

    def _cycle(self, level: int, right: np.ndarray) -> np.ndarray:
        """Return the V-cycle's x for ``right`` of a level: sweep forward, add the coarser level's x, sweep backward."""
        if level == 0:
            return self._bottom.solve(right)
        x, residual = self._sweeps[level - 1].forward(right)
        parents, weights = self._parents[level - 1]
        coarse = np.zeros((self.patterns[level - 1].size, *right.shape[1:]))
        fine = residual.reshape(len(residual), -1)
        _restrict(parents, weights, fine, self.held[level - 1], coarse.reshape(len(coarse), -1))
        _prolongate(parents, weights, self._cycle(level - 1, coarse).reshape(len(coarse), -1), fine)
        return self._sweeps[level - 1].backward(x, residual)


def _parents(prolongation: sparse.csr_array) -> tuple[np.ndarray, np.ndarray]:
    """Return each fine node's two parents (n, 2) and their weights; a node of the coarse mesh has one of them twice."""
    first_entry = prolongation.indptr[:-1]
    last_entry = prolongation.indptr[1:] - 1
    parents = np.stack([prolongation.indices[first_entry], prolongation.indices[last_entry]], axis=1)
    weights = np.where((first_entry == last_entry)[:, None], [1.0, 0.0], 0.5)
    return parents.astype(np.int32), weights


@numba.njit(cache=True)
def _find_slots(indptr, indices, parents, coarse_indptr, coarse_indices):
    """Return the positions (n_blocks, 2, 2) among the coarse blocks to which Pᵀ K P adds each fine block."""
    slots = np.empty((len(indices), 2, 2), dtype=np.int32)
    for i in range(len(indptr) - 1):
        for p in range(2):
            begin, end = coarse_indptr[parents[i, p]], coarse_indptr[parents[i, p] + 1]
            row = coarse_indices[begin:end]
            for k in range(indptr[i], indptr[i + 1]):
                for q in range(2):
                    slots[k, p, q] = begin + np.searchsorted(row, parents[indices[k], q])
    return slots


@numba.njit(cache=True)
def _galerkin(indptr, indices, values, weights, slots, coarse):
    """Add Pᵀ K P, of the fine blocks ``values`` of K, to the ``coarse`` blocks at ``slots``."""
    for i in range(len(indptr) - 1):
        for k in range(indptr[i], indptr[i + 1]):
            for p in range(2):
                for q in range(2):
                    w = weights[i, p] * weights[indices[k], q]
                    if w != 0.0:
                        for a in range(3):
                            for b in range(3):
                                coarse[slots[k, p, q], a, b] += w * values[k, a, b]


@numba.njit(cache=True)
def _restrict(parents, weights, fine, held, coarse):
    for i in range(len(fine)):
        for p in range(2):
            j = parents[i, p]
            if weights[i, p] != 0.0 and not held[j]:
                for a in range(fine.shape[1]):
                    coarse[j, a] += weights[i, p] * fine[i, a]


@numba.njit(cache=True)
def _prolongate(parents, weights, coarse, fine):
    for i in range(len(fine)):
        for a in range(fine.shape[1]):
            fine[i, a] = weights[i, 0] * coarse[parents[i, 0], a] + weights[i, 1] * coarse[parents[i, 1], a]


def conjugate_gradients(
    multiply: Callable[[np.ndarray], np.ndarray],
    precondition: Callable[[np.ndarray], np.ndarray],
    right: np.ndarray,
    relative_tolerance: float,
    max_iterations: int,
) -> tuple[np.ndarray, int, bool]:
    """Solve K x = ``right`` (n, 3) from zero; return x, the number of products, and whether all curvature was positive.

    ``right`` may be k right sides (n, 3, k), none of them zero: each has its own steps, and the last one ends them all.
    Stops at ‖residual‖ ≤ ``relative_tolerance`` ‖right‖, after ``max_iterations``, or at the first direction along
    which K or the preconditioner has no positive curvature. The x found so far is then a descent direction, unless it
    is zero (Steihaug 1983).
    """
    x = np.zeros_like(right)
    residual = right.copy()
    target = relative_tolerance * np.sqrt(_products(right, right))
    direction: np.ndarray | None = None
    previous: np.ndarray | float = 1.0
    for iteration in range(1, max_iterations + 1):
        preconditioned = precondition(residual)
        rho = _products(residual, preconditioned)
        if not np.all(rho > 0.0):
            return x, iteration, False
        direction = preconditioned.copy() if direction is None else preconditioned + (rho / previous) * direction
        product = multiply(direction)
        curvature = _products(direction, product)
        if not np.all(curvature > 0.0):
            return x, iteration, False
        step = rho / curvature
        x += step * direction
        residual -= step * product
        previous = rho
        if np.all(np.sqrt(_products(residual, residual)) <= target):
            break
    return x, iteration, True


def _products(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the scalar product of ``a`` and ``b`` (n, 3), or those (k,) of each right side of (n, 3, k)."""
    return np.asarray(np.vdot(a, b) if a.ndim == 2 else np.einsum("nik,nik->k", a, b))


MAX_PRODUCTS = 3000
"""Products after which conjugate gradients give up."""


def linear_response(
    multiply: Callable[[np.ndarray], np.ndarray],
    precondition: Callable[[np.ndarray], np.ndarray],
    right: np.ndarray,
    tolerance: float,
) -> np.ndarray:
    """Return the displacements [m] of a linear body under loads ``right`` [N], both (n, 3), or (n, 3, k) for k loads.

    multiply, precondition : products of the stiffness and of an approximate inverse with such arrays
    Several loads at once share each reading of the matrix. Raises NotConverged if conjugate gradients do not reach the
    relative residual ``tolerance`` for each of them.
    """
    if not right.any():
        return np.zeros_like(right)
    if right.ndim == 3 and not (loaded := right.any(axis=(0, 1))).all():
        response = np.zeros_like(right)
        response[:, :, loaded] = linear_response(multiply, precondition, right[:, :, loaded], tolerance)
        return response
    response, products, _ = conjugate_gradients(multiply, precondition, right, tolerance, MAX_PRODUCTS)
    worst = float(np.max(np.linalg.norm(right - multiply(response), axis=(0, 1)) / np.linalg.norm(right, axis=(0, 1))))
    if not worst <= 10 * tolerance:
        raise NotConverged(
            f"the linear response stopped after {products} products at a relative residual of {worst:.1e}, "
            f"above the tolerance {tolerance:.0e}",
            [worst],
        )
    return response
