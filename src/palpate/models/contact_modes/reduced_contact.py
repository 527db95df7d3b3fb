"""A reduced model of one contact: a basis, cells that give the energy, and a compiled L-BFGS that settles it.

Cells are points of elements near the contact and averages of elements elsewhere, of which few are chosen, with weights
that are not negative, that pull as all do.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numba
import numpy as np

from palpate.effects import principal
from palpate.effects.corotational import BLOCK, hessians, rotations, stresses, turned
from palpate.effects.law import Law
from palpate.errors import NotConverged
from palpate.models.contact_modes.elements_at_rest import ElementsAtRest

MEMORY = 10
"""Steps that the inverse Hessian is improved by."""


@numba.njit(cache=True, error_model="numpy")
def cell_stresses(q, slopes, volumes, mu, lam, shape, measure, volume, f, p, energies, accepted):
    """Write F (9, k) of k cells and their stresses times volumes (9, k) [J] into ``f, p``; return their energy [J].

    q : (r,); slopes : (9 k, r); energies, accepted : (k,) scratch; shape, measure, volume : of the law, or None
    """
    count = len(volumes)
    moved = np.dot(slopes, q)
    for i in range(9):
        one = 1.0 if i % 4 == 0 else 0.0
        for k in range(count):
            f[i, k] = moved[i * count + k] + one
    if shape is None:
        stresses(f, p, count, mu, lam, energies, accepted)
    else:
        principal.stresses(f, p, count, 1, mu, lam, shape, measure, volume, energies)
    total = 0.0
    for k in range(count):
        total += volumes[k] * energies[k]
    for i in range(9):
        for k in range(count):
            p[i, k] *= volumes[k]
    return total


@numba.njit(cache=True, error_model="numpy")
def pulled_by_each(p, slopes, pulls):
    """Write what each of k cells adds to the gradient into ``pulls`` (k, r); p : (9, k) [J]; slopes : (9, k, r)."""
    pulls[:] = 0.0
    for i in range(9):
        for k in range(pulls.shape[0]):
            for j in range(pulls.shape[1]):
                pulls[k, j] += p[i, k] * slopes[i, k, j]


@numba.njit(cache=True, error_model="numpy")
def settle(load, slopes, volumes, mu, lam, rest, shape, measure, volume, tolerance, iterations, q):
    """Minimise Σ Ψ(F(q)) V + ½ qᵀ rest q − load · q from ``q`` (r,) in place, by L-BFGS that starts from the identity.

    load : (r,); rest : (r, r), what the cells' energy lacks at rest; the others as in ``cell_stresses``
    The coordinates are those in which the whole stiffness at rest is the identity, so that one step answers small
    loads. Returns the residual over the load, the smallest det F of the cells, and the energies computed. The residual
    is above ``tolerance`` where the search has ended without one.
    """
    r, count = len(load), len(volumes)
    steps, bends, scale, part = np.zeros((MEMORY, r)), np.zeros((MEMORY, r)), np.zeros(MEMORY), np.zeros(MEMORY)
    f, p = np.empty((9, count)), np.empty((9, count))
    energies, accepted = np.empty(count), np.empty(count, dtype=np.bool_)
    cells = (slopes, volumes, mu, lam, shape, measure, volume, f, p, energies, accepted)
    enough = tolerance * np.sqrt(np.dot(load, load))
    pull = np.dot(rest, q)
    energy = cell_stresses(q, *cells) + 0.5 * np.dot(q, pull) - np.dot(load, q)
    gradient = np.dot(p.ravel(), slopes) + pull - load
    kept, calls = 0, 1
    for _ in range(iterations):
        if np.sqrt(np.dot(gradient, gradient)) <= enough:
            break
        ahead = -gradient
        oldest = max(0, kept - MEMORY)
        for j in range(kept - 1, oldest - 1, -1):
            m = j % MEMORY
            part[m] = scale[m] * np.dot(steps[m], ahead)
            ahead -= part[m] * bends[m]
        for j in range(oldest, kept):
            m = j % MEMORY
            ahead += (part[m] - scale[m] * np.dot(bends[m], ahead)) * steps[m]
        slope, length, found = -np.dot(gradient, ahead), 1.0, False
        while slope > 0.0 and length > 1e-4:
            reached = q + length * ahead
            pull = np.dot(rest, reached)
            lower = cell_stresses(reached, *cells) + 0.5 * np.dot(reached, pull) - np.dot(load, reached)
            calls += 1
            if lower <= energy - 1e-4 * length * slope + 1e-12 * abs(energy):
                found = True
                break
            length *= 0.5
        if not found:
            if kept == 0:
                break
            kept = 0
            continue
        bent = np.dot(p.ravel(), slopes) + pull - load
        m = kept % MEMORY
        steps[m], bends[m] = reached - q, bent - gradient
        curvature = np.dot(steps[m], bends[m])
        if curvature > 0.0:
            scale[m] = 1.0 / curvature
            kept += 1
        q[:], gradient[:], energy = reached, bent, lower
    left = np.sqrt(np.dot(gradient, gradient)) / max(np.sqrt(np.dot(load, load)), 1e-300)
    return left, least_det(q, slopes, count), calls


@numba.njit(cache=True, error_model="numpy")
def least_det(q, slopes, count):
    """Return the smallest det F of so many cells at ``q`` (r,); slopes : (9 count, r)."""
    moved, least = np.dot(slopes, q), np.inf
    for k in range(count):
        a, b, c = moved[k] + 1.0, moved[count + k], moved[2 * count + k]
        d, e, g = moved[3 * count + k], moved[4 * count + k] + 1.0, moved[5 * count + k]
        h, i, j = moved[6 * count + k], moved[7 * count + k], moved[8 * count + k] + 1.0
        least = min(least, a * (e * j - g * i) - b * (d * j - g * h) + c * (d * i - e * h))
    return least


@numba.njit(cache=True, error_model="numpy")
def _plain_tangent(q, slopes, volumes, mu, lam, begin, end):
    """Return what the cells from ``begin`` to ``end`` add to ``tangent`` by the corotational law, less 2 μ V |δF|².

    With the columns g of R this is λ V (Σ g · δF g)² + tᵀ M t for t = Σ g × δF g, as ``corotational.turned`` has M.
    NaN where a cell's rotation is not known.
    """
    r, size = len(q), end - begin
    f, axes, rotated = np.empty((9, BLOCK)), np.zeros((9, BLOCK)), np.empty((15, BLOCK))
    sure = np.empty(BLOCK, dtype=np.bool_)
    for i in range(9):
        f[i, :size] = np.dot(slopes[i, begin:end], q)
    f[::4] += 1.0
    axes[::4] = 1.0
    rotations(f, rotated, size, sure)
    turned(f, axes, volumes[begin:end], size, mu[begin:end], lam[begin:end], rotated)
    rows, bent = np.empty((4 * size, r)), np.empty((4 * size, r))
    for k in range(size):
        if not sure[k]:
            return np.full((r, r), np.nan)
        a, b, c, d, e, g = rotated[9, k], rotated[10, k], rotated[11, k], rotated[12, k], rotated[13, k], rotated[14, k]
        g00, g01, g02 = rotated[0, k], rotated[1, k], rotated[2, k]
        g10, g11, g12 = rotated[3, k], rotated[4, k], rotated[5, k]
        g20, g21, g22 = rotated[6, k], rotated[7, k], rotated[8, k]
        n, share = begin + k, lam[begin + k] * volumes[begin + k]
        for m in range(r):
            x0, x1, x2 = slopes[0, n, m], slopes[1, n, m], slopes[2, n, m]
            y0, y1, y2 = slopes[3, n, m], slopes[4, n, m], slopes[5, n, m]
            z0, z1, z2 = slopes[6, n, m], slopes[7, n, m], slopes[8, n, m]
            s = g00 * x0 + g01 * y0 + g02 * z0 + g10 * x1 + g11 * y1 + g12 * z1 + g20 * x2 + g21 * y2 + g22 * z2
            u = g01 * z0 - g02 * y0 + g11 * z1 - g12 * y1 + g21 * z2 - g22 * y2
            v = g02 * x0 - g00 * z0 + g12 * x1 - g10 * z1 + g22 * x2 - g20 * z2
            w = g00 * y0 - g01 * x0 + g10 * y1 - g11 * x1 + g20 * y2 - g21 * x2
            rows[4 * k, m], rows[4 * k + 1, m], rows[4 * k + 2, m], rows[4 * k + 3, m] = s, u, v, w
            bent[4 * k, m], bent[4 * k + 1, m] = share * s, a * u + b * v + c * w
            bent[4 * k + 2, m], bent[4 * k + 3, m] = b * u + d * v + e * w, c * u + e * v + g * w
    return np.dot(rows.T, bent)


@numba.njit(cache=True, error_model="numpy")
def _law_tangent(q, slopes, volumes, mu, lam, begin, end, shape, measure, volume, definite):
    """Return what the cells from ``begin`` to ``end`` add to ``tangent`` by any law; ``definite`` clamps each cell."""
    r, size = len(q), end - begin
    f, axes, blocks = np.empty((9, BLOCK)), np.zeros((9, BLOCK)), np.empty((54, BLOCK))
    pulls, stiffnesses, bent = np.empty((15, BLOCK)), np.empty(BLOCK), np.zeros((9, size, r))
    for i in range(9):
        f[i, :size] = np.dot(slopes[i, begin:end], q)
    f[::4] += 1.0
    axes[::4] = 1.0
    moduli, law = (mu[begin:end], lam[begin:end]), (shape, measure, volume)
    if shape is None:
        hessians(f, axes, volumes[begin:end], size, *moduli, definite, pulls, blocks)
    else:
        principal.hessians(f, axes, volumes[begin:end], size, 1, *moduli, *law, definite, blocks, pulls, stiffnesses)
    near = slopes[:, begin:end].copy()
    for pair in range(6):
        c, d = principal.PAIRS[pair]
        for n in range(9):
            i, j = n // 3, n % 3
            for k in range(size):
                block = blocks[9 * pair + n, k]
                for m in range(r):
                    bent[3 * i + c, k, m] += block * near[3 * j + d, k, m]
                if c != d:
                    for m in range(r):
                        bent[3 * j + d, k, m] += block * near[3 * i + c, k, m]
    return np.dot(near.reshape(9 * size, r).T, bent.reshape(9 * size, r))


@numba.njit(cache=True, error_model="numpy")
def add_tangent(q, slopes, volumes, mu, lam, shape, measure, volume, found):
    """Add to ``found`` (r, r) what of the tangent of k cells changes with ``q`` (r,); slopes : (9, k, r)."""
    for begin in range(0, len(volumes), BLOCK):
        end = min(begin + BLOCK, len(volumes))
        if shape is None:
            found += _plain_tangent(q, slopes, volumes, mu, lam, begin, end)
        else:
            found += _law_tangent(q, slopes, volumes, mu, lam, begin, end, shape, measure, volume, False)


@numba.njit(cache=True, error_model="numpy")
def clamped_tangent(q, slopes, volumes, mu, lam, shape, measure, volume):
    """Return the Hessian (r, r) of k cells' energy at ``q`` (r,), each clamped positive; slopes : (9, k, r)."""
    found = np.zeros((len(q), len(q)))
    for begin in range(0, len(volumes), BLOCK):
        end = min(begin + BLOCK, len(volumes))
        found += _law_tangent(q, slopes, volumes, mu, lam, begin, end, shape, measure, volume, True)
    return found


@numba.njit(cache=True, error_model="numpy")
def is_positive(matrix):
    """Return whether the symmetric ``matrix`` (r, r) is positive definite, by Cholesky's pivots; not if it is NaN."""
    work = matrix.copy()
    for k in range(len(work)):
        if not work[k, k] > 0.0:
            return False
        for i in range(k + 1, len(work)):
            share = work[i, k] / work[k, k]
            for j in range(k + 1, i + 1):
                work[i, j] -= share * work[j, k]
    return True


def softness(surface: np.ndarray) -> np.ndarray:
    """Return (r, r), the mean square motion of the ``surface`` (n, 3, r) over the largest that has unit energy at rest.

    A tangent less a share of it is positive definite where nothing has become softer than that share of what the body's
    softest motion is at rest. Trap: the tangent's own eigenvalues are small in any bent body, which does not stretch
    in the same directions as the straight one.
    """
    flat = surface.reshape(-1, surface.shape[2])
    square = flat.T @ flat
    return square / np.linalg.eigvalsh(square)[-1]


LEAST_COLUMN = 1e-6
"""Columns smaller than this part of the largest are not taken: rounding would choose them, with huge weights."""


def few_of(pulls: np.ndarray, target: np.ndarray, tolerance: float) -> tuple[np.ndarray, np.ndarray]:
    """Return numbers (k,) and weights (k,) > 0 of columns whose weighted sum is ``target``, to ``tolerance``.

    pulls : (rows, n), what each of n cells pulls by under the training loads; target : (rows,), what all pull by; the
        tolerance is relative
    Non-negative least squares that ends early (Lawson and Hanson 1974, chapter 23; Farhat, Chapman and Avery 2015,
    algorithm 1): columns are taken one by one, the one most like the remainder first, so that few are left.
    """
    size = np.linalg.norm(pulls, axis=0)
    size = np.where(size > LEAST_COLUMN * size.max(), size, np.inf)
    rough = pulls.astype(np.float32)  # enough to choose by, and half as long
    most = min(pulls.shape)
    fit = _Fit(target, most)
    while np.linalg.norm(fit.left) > tolerance * np.linalg.norm(target) and len(fit.chosen) < most:
        likeness = (fit.left.astype(np.float32) @ rough) / size
        likeness[fit.chosen] = -np.inf
        best = int(np.argmax(likeness))
        if not likeness[best] > 0.0:
            break
        fit.take(best, pulls[:, best])
    return np.array(fit.chosen, dtype=int), fit.weights


class _Fit:
    """The columns that are chosen, their weights, and what is left of the target (rows,); at most ``most`` of them."""

    def __init__(self, target: np.ndarray, most: int):
        self.chosen: list[int] = []
        self.weights: np.ndarray = np.empty(0)
        self.left, self._target = target, target
        # the columns as rows, their products, and those with the target; only the first of them are in use
        self._columns, self._square, self._aim = np.empty((most, len(target))), np.empty((most, most)), np.empty(most)

    def take(self, number: int, column: np.ndarray) -> None:
        """Take one column more, and drop those whose weights would be negative: the inner loop of NNLS."""
        j = len(self.chosen)
        self._columns[j], self._aim[j] = column, column @ self._target
        self._square[j, : j + 1] = self._square[: j + 1, j] = self._columns[: j + 1] @ column
        self._square[j, j] *= 1.0 + 1e-12
        self.chosen, self.weights = [*self.chosen, number], np.append(self.weights, 0.0)
        while self.chosen and not self._fitted():
            pass
        self.left = self._target - self.weights @ self._columns[: len(self.chosen)]

    def _fitted(self) -> bool:
        """Fit the weights, or go as far towards the fit as none is negative, and drop those that are zero there."""
        j = len(self.chosen)
        fitted = np.linalg.solve(self._square[:j, :j], self._aim[:j])
        if fitted.min() > 0.0:
            self.weights = fitted
            return True
        falling = fitted <= 0.0
        ratio = self.weights[falling] / np.maximum(self.weights[falling] - fitted[falling], 1e-300)
        weights = self.weights + ratio.min() * (fitted - self.weights)
        kept = weights > 1e-14 * max(float(weights.max()), 1e-300)
        if kept.all():
            kept[np.argmin(fitted)] = False
        self._keep(np.flatnonzero(kept), weights)
        return False

    def _keep(self, rows: np.ndarray, weights: np.ndarray) -> None:
        count = len(rows)
        self.chosen, self.weights = [self.chosen[k] for k in rows], weights[rows]
        self._columns[:count], self._aim[:count] = self._columns[rows], self._aim[rows]
        self._square[:count, :count] = self._square[np.ix_(rows, rows)]


class Cells(NamedTuple):
    """k cells, whose deformation gradients are I + slopes q for r coordinates q.

    slopes : (9, k, r), the entries of F row by row; volumes : (k,) [m³], or weights times volumes; mu, lam : (k,) [Pa]
    """

    slopes: np.ndarray
    volumes: np.ndarray
    mu: np.ndarray
    lam: np.ndarray

    def take(self, chosen: np.ndarray, weights: np.ndarray) -> "Cells":
        """Return those numbered ``chosen`` (j,), with volumes times ``weights`` (j,)."""
        slopes = np.ascontiguousarray(self.slopes[:, chosen])
        return Cells(slopes, self.volumes[chosen] * weights, self.mu[chosen], self.lam[chosen])

    @property
    def stiffness(self) -> np.ndarray:
        """The Hessian (r, r) of their energy at rest, Σ V (2μ e : e + λ tr e tr e)."""
        strain, trace = self._strains
        found = trace.T @ ((self.volumes * self.lam)[:, None] * trace)
        for part in strain:
            found += part.T @ ((2.0 * self.volumes * self.mu)[:, None] * part)
        return found

    def stiffnesses(self) -> np.ndarray:
        """Return the same of each cell, (k, r, r)."""
        strain, trace = self._strains
        found = (self.volumes * self.lam)[:, None, None] * (trace[:, :, None] * trace[:, None, :])
        for part in strain:
            found += (2.0 * self.volumes * self.mu)[:, None, None] * (part[:, :, None] * part[:, None, :])
        return found

    @property
    def _strains(self) -> tuple[np.ndarray, np.ndarray]:
        """The strains (9, k, r) of each coordinate, and their traces (k, r)."""
        _, count, modes = self.slopes.shape
        f = self.slopes.reshape(3, 3, count, modes)
        strain = 0.5 * (f + f.transpose(1, 0, 2, 3)).reshape(9, count, modes)
        return strain, strain[0] + strain[4] + strain[8]


def rings_around(elements: ElementsAtRest, nodes: np.ndarray, rings: int) -> np.ndarray:
    """Mark the elements (m,) that touch ``nodes`` (k,), and so many ``rings`` of elements around them."""
    marked = np.zeros(len(elements.rest), dtype=bool)
    marked[nodes] = True
    near = marked[elements.couples].any(axis=1)
    for _ in range(rings):
        marked[elements.couples[near]] = True
        near = marked[elements.couples].any(axis=1)
    return near


def cells_of(elements: ElementsAtRest, modes: np.ndarray, exact: np.ndarray, together: int = 1) -> Cells:
    """Return the cells of ``modes`` (n, 3, r): each point of ``exact`` elements (m,), bool, and the others' means.

    together : how many elements, one after another, share one mean where none of them is exact: 1 or, of elements that
        come from split ones, 8
    """
    few = exact if together == 1 else np.repeat(exact.reshape(-1, together).any(axis=1), together)
    near, alone, many = np.flatnonzero(exact), np.flatnonzero(few & ~exact), np.flatnonzero(~few)
    gradients = elements.point_gradients(near)
    owner = np.repeat(near, gradients.shape[1])
    gradients = gradients.reshape(len(owner), elements.couples.shape[1], 3)
    parts = [_cells(elements, modes, owner, gradients, elements.volumes[owner] / (len(owner) / max(len(near), 1)))]
    for chosen, size in ((alone, 1), (many, together)):
        if len(chosen):
            means = _cells(elements, modes, chosen, elements.mean_gradients(chosen), elements.volumes[chosen])
            parts.append(_averaged(means, size))
    slopes, *rest = zip(*parts, strict=True)
    return Cells(np.concatenate(slopes, axis=1), *(np.concatenate(each) for each in rest))


def _averaged(cells: Cells, together: int) -> Cells:
    """Return the means of so many cells, one after another, by their volumes."""
    if together == 1:
        return cells
    volumes = cells.volumes.reshape(-1, together)
    total = volumes.sum(axis=1)
    shares = volumes / total[:, None]
    slopes = np.einsum("ckjr,kj->ckr", cells.slopes.reshape(9, *shares.shape, -1), shares)
    moduli = [(modulus.reshape(shares.shape) * shares).sum(axis=1) for modulus in (cells.mu, cells.lam)]
    return Cells(slopes, total, *moduli)


def some_points(
    elements: ElementsAtRest, modes: np.ndarray, near: np.ndarray, few: int, rng: np.random.Generator
) -> Cells:
    """Return as cells of ``modes`` (n, 3, r) all points of the elements ``near`` (m,), bool, and ``few`` of the others.

    The others are drawn by ``rng``; all of them are taken if there are no more.
    """
    points = elements.points
    close = np.repeat(near, points)
    others = np.flatnonzero(~close)
    drawn = rng.choice(others, min(few, len(others)), replace=False)
    chosen = np.sort(np.append(np.flatnonzero(close), drawn))
    source = chosen // points
    gradients = elements.gradients_at(source, chosen % points)
    return _cells(elements, modes, source, gradients, elements.volumes[source] / points)


def _cells(
    elements: ElementsAtRest, modes: np.ndarray, source: np.ndarray, gradients: np.ndarray, volumes: np.ndarray
) -> Cells:
    """Return cells of the elements ``source`` (k,), whose shape functions have ``gradients`` (k, a, 3) [1/m] there."""
    (count, corners), wide = gradients.shape[:2], modes.shape[2]
    moved = modes[elements.couples[source]].transpose(0, 2, 3, 1).reshape(count, 3 * wide, corners)
    slopes = np.matmul(moved, gradients).reshape(count, 3, wide, 3).transpose(0, 1, 3, 2)
    flat = slopes.reshape(count, 9, wide).transpose(1, 0, 2)
    return Cells(np.ascontiguousarray(flat), volumes, *(modulus[source] for modulus in elements.moduli))


ITERATIONS = 200


class Coordinates(NamedTuple):
    """Coordinates at which a reduced model has come to rest.

    q : (r,); residual : what is left, over the load; least_det : the smallest det F of its cells
    """

    q: np.ndarray
    residual: float
    least_det: float


class ReducedContact:
    """The energy Σ Ψ(F) V + ½ qᵀ (I − K) q over cells, K being their stiffness at rest: exact to first order.

    The coordinates q (r,) are those of a basis in which the stiffness at rest is the identity.
    loads : (r, f), the unit forces in these coordinates, three of each contact
    base : (r, r), what of the tangent does not change
    """

    def __init__(self, cells: Cells, loads: np.ndarray, law: Law, rest: np.ndarray | None = None):
        self.cells, self.loads, self.law = cells, np.ascontiguousarray(loads), law
        self._slopes = cells.slopes.reshape(-1, cells.slopes.shape[2])
        self.rest = np.eye(len(loads)) - cells.stiffness if rest is None else rest
        self.base = self.rest
        if law.shape is None:
            weighted = np.tile(2.0 * cells.mu * cells.volumes, 9)[:, None] * self._slopes
            self.base = self.rest + self._slopes.T @ weighted

    def settle(self, force: np.ndarray, tolerance: float) -> Coordinates:
        """Return the coordinates under ``force`` (f,) [N], whose residual is above ``tolerance`` if none were found."""
        q, load = np.zeros(len(self.loads)), self.loads @ force
        cells = (self._slopes, self.cells.volumes, self.cells.mu, self.cells.lam, self.rest)
        left, least, _ = settle(load, *cells, *self.law, tolerance, ITERATIONS, q)
        return Coordinates(q, left, least)

    def at_rest(self, force: np.ndarray, tolerance: float) -> Coordinates:
        """Return the coordinates under ``force`` (f,) [N]; NotConverged if none have so small a residual."""
        found = self.settle(force, tolerance)
        if not found.residual <= tolerance:
            raise NotConverged(f"the reduced model stopped at a residual of {found.residual:.1e}", [found.residual])
        return found

    def tangent(self, q: np.ndarray) -> np.ndarray:
        """Return the Hessian (r, r) of the energy at ``q`` (r,): the identity at rest, singular where it gives way.

        It is NaN where a cell of the corotational law is inverted.
        """
        found = self.base.copy()
        add_tangent(q, *self.cells, *self.law, found)
        return found

    def thinned(
        self, answers: Sequence[np.ndarray], tolerance: float, wanted: Sequence[np.ndarray] | None = None
    ) -> "ReducedContact":
        """Return a model of few cells, which pull as all do at the ``answers`` [(r,)], to the relative ``tolerance``.

        Only what is not linear is fitted, each answer by itself over its size; the linear part is exact in any case.
        wanted : by what all pull beyond their linear part, [(r,)], if the cells are not all there are
        """
        return ReducedContact(self.cells.take(*self.few(answers, tolerance, wanted)), self.loads, self.law)

    def few(
        self, answers: Sequence[np.ndarray], tolerance: float, wanted: Sequence[np.ndarray] | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the numbers (k,) of the cells of ``thinned`` and their weights (k,)."""
        pulls = self.nonlinear_pulls(np.array(answers))
        sums = pulls.sum(axis=0) if wanted is None else np.array(wanted)
        sizes = np.linalg.norm(sums, axis=1)
        pulls /= sizes[:, None]
        return few_of(pulls.reshape(len(pulls), -1).T, (sums / sizes[:, None]).ravel(), tolerance)

    def nonlinear_pulls(self, answers: np.ndarray) -> np.ndarray:
        """Return what each cell adds to the gradient beyond its linear part at ``answers`` (s, r): (k, s, r)."""
        slopes, volumes, mu, lam = self.cells
        count = len(volumes)
        f, p = np.empty((9, count)), np.empty((9, count))
        energies, accepted = np.empty(count), np.empty(count, dtype=bool)
        found = np.empty((count, *answers.shape))
        for s, q in enumerate(answers):
            cell_stresses(q, self._slopes, volumes, mu, lam, *self.law, f, p, energies, accepted)
            moved = f.reshape(3, 3, count) - np.eye(3)[:, :, None]
            strain = 0.5 * (moved + moved.transpose(1, 0, 2)).reshape(9, count)
            linear = 2.0 * mu * strain
            linear[[0, 4, 8]] += lam * (strain[0] + strain[4] + strain[8])
            pulled_by_each(p - linear * volumes, slopes, found[:, s])
        return found
