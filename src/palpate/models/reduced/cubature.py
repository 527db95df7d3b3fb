"""Hyper-reduction: few points of elements, with weights that are not negative, whose energy is that of all elements.

Points are chosen from all points of elements near a place and means, or some points, of the others.
"""

from collections.abc import Callable, Sequence

import numpy as np

from palpate.effects.law import Law
from palpate.errors import NotConverged
from palpate.models.contact_modes.elements_at_rest import ElementsAtRest
from palpate.models.reduced.basis import products
from palpate.models.reduced.cells import Cells, cell_stresses, pulled_by_each
from palpate.models.reduced.energy import ReducedEnergy

FEW = 2000
"""Points beside those near a place that cells are chosen from; with all of them answers are no better."""


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
    parts = [_points(elements, modes, np.flatnonzero(np.repeat(exact, elements.points)))]
    for chosen, size in ((np.flatnonzero(few & ~exact), 1), (np.flatnonzero(~few), together)):
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


def some_points(elements: ElementsAtRest, modes: np.ndarray, near: np.ndarray, rng: np.random.Generator) -> Cells:
    """Return as cells of ``modes`` (n, 3, r) all points of the elements ``near`` (m,), bool, and FEW of the others.

    The others are drawn by ``rng``; all of them are taken if there are no more.
    """
    close = np.repeat(near, elements.points)
    others = np.flatnonzero(~close)
    drawn = rng.choice(others, min(FEW, len(others)), replace=False)
    return _points(elements, modes, np.sort(np.append(np.flatnonzero(close), drawn)))


def _points(elements: ElementsAtRest, modes: np.ndarray, numbers: np.ndarray) -> Cells:
    """Return cells of the points of integration with these ``numbers`` (k,), element by element."""
    source, point = np.divmod(numbers, elements.points)
    gradients = elements.gradients_at(source, point)
    return _cells(elements, modes, source, gradients, elements.volumes[source] / elements.points)


def _cells(
    elements: ElementsAtRest, modes: np.ndarray, source: np.ndarray, gradients: np.ndarray, volumes: np.ndarray
) -> Cells:
    """Return cells of the elements ``source`` (k,), whose shape functions have ``gradients`` (k, a, 3) [1/m] there."""
    (count, corners), wide = gradients.shape[:2], modes.shape[2]
    moved = modes[elements.couples[source]].transpose(0, 2, 3, 1).reshape(count, 3 * wide, corners)
    slopes = np.matmul(moved, gradients).reshape(count, 3, wide, 3).transpose(0, 1, 3, 2)
    flat = slopes.reshape(count, 9, wide).transpose(1, 0, 2)
    return Cells(np.ascontiguousarray(flat), volumes, *(modulus[source] for modulus in elements.moduli))


LEAST_COLUMN = 1e-6
"""Points whose pulls are smaller than this part of the largest are not taken: rounding would choose them, with huge
weights."""


def few_of(pulls: np.ndarray, target: np.ndarray, tolerance: float) -> tuple[np.ndarray, np.ndarray]:
    """Return numbers (k,) and weights (k,) > 0 of rows whose weighted sum is ``target``, to ``tolerance``.

    pulls : (n, m), what each of n points pulls by under the training loads; target : (m,), what all pull by; the
        tolerance is relative
    Non-negative least squares that ends early (Lawson and Hanson 1974, chapter 23; Farhat, Chapman and Avery 2015,
    algorithm 1): rows are taken one by one, the one most like the remainder first, so that few are left.
    """
    size = np.linalg.norm(pulls, axis=1)
    size = np.where(size > LEAST_COLUMN * size.max(), size, np.inf)
    rough = pulls.T.astype(np.float32)  # enough to choose by, and half as long
    chosen: np.ndarray = np.empty(0, dtype=int)
    weights: np.ndarray = np.empty(0)
    left = target
    square, aim = np.empty((0, 0)), np.empty(0)  # the products of the chosen with each other, and with the target
    while np.linalg.norm(left) > tolerance * np.linalg.norm(target) and len(chosen) < min(pulls.shape):
        likeness = (left.astype(np.float32) @ rough) / size
        likeness[chosen] = -np.inf
        best = int(np.argmax(likeness))
        if not likeness[best] > 0.0:
            break
        chosen, weights = np.append(chosen, best), np.append(weights, 0.0)
        row = pulls[chosen] @ pulls[best]
        row[-1] *= 1.0 + 1e-12
        square, aim = np.block([[square, row[:-1, None]], [row]]), np.append(aim, pulls[best] @ target)
        while len(chosen):
            fitted = np.linalg.solve(square, aim)
            if fitted.min() > 0.0:
                weights = fitted
                break
            # as far towards the fit as no weight is negative, without those that are zero there
            falling = fitted <= 0.0
            ratio = weights[falling] / np.maximum(weights[falling] - fitted[falling], 1e-300)
            weights = weights + ratio.min() * (fitted - weights)
            kept = weights > 1e-14 * max(float(weights.max()), 1e-300)
            if kept.all():
                kept[np.argmin(fitted)] = False
            chosen, weights, aim, square = chosen[kept], weights[kept], aim[kept], square[np.ix_(kept, kept)]
        left = target - weights @ pulls[chosen]
    return chosen, weights


def thinned(
    model: ReducedEnergy, states: np.ndarray, tolerance: float, wanted: np.ndarray | None = None
) -> ReducedEnergy:
    """Return a model of few cells, which pull as all do at ``states`` (s, r), to the relative ``tolerance``.

    Only what is not linear is fitted, each state by itself over its size; the linear part is exact in any case.
    wanted : (s, r), by what all pull beyond their linear part, if the cells are not all there are
    """
    pulls = nonlinear_pulls(model.cells, model.law, states)
    sums = pulls.sum(axis=0) if wanted is None else wanted
    sizes = np.linalg.norm(sums, axis=1)[:, None]
    chosen, weights = few_of((pulls / sizes).reshape(len(pulls), -1), (sums / sizes).ravel(), tolerance)
    return ReducedEnergy(model.cells.take(chosen, weights), model.loads, model.law)


def like_elements(
    elements: ElementsAtRest,
    modes: np.ndarray,
    near: np.ndarray,
    states: np.ndarray,
    tolerance: float,
    rng: np.random.Generator,
    loads: np.ndarray | None = None,
    moved: Sequence[np.ndarray] | None = None,
) -> ReducedEnergy:
    """Return a model of few points that pull as the elements themselves do at ``states`` (s, r) of ``modes``.

    near, rng : as ``some_points`` has them, which are chosen from; tolerance : as in ``thinned``
    loads : (r, f), unit forces; moved : displacements (n, 3) [m] at the states, if modes do not span them
    """
    moved, count = [modes @ q for q in states] if moved is None else moved, modes.shape[2]
    pulls = -np.array([elements.force(each).ravel() for each in moved]) @ modes.reshape(-1, count) - states
    loads = np.empty((count, 0)) if loads is None else loads
    model = ReducedEnergy(some_points(elements, modes, near, rng), loads, elements.law, np.zeros((count, count)))
    return thinned(model, states, tolerance, pulls)


def nonlinear_pulls(cells: Cells, law: Law, states: np.ndarray) -> np.ndarray:
    """Return what each of k cells adds to the gradient beyond its linear part at ``states`` (s, r): (k, s, r)."""
    slopes, volumes, mu, lam = cells
    count = len(volumes)
    flat, f, p = slopes.reshape(9 * count, -1), np.empty((9, count)), np.empty((9, count))
    energies, accepted = np.empty(count), np.empty(count, dtype=bool)
    found = np.empty((count, *states.shape))
    for s, q in enumerate(np.ascontiguousarray(states)):
        cell_stresses(q, flat, volumes, mu, lam, *law, f, p, energies, accepted)
        moved = f.reshape(3, 3, count) - np.eye(3)[:, :, None]
        strain = 0.5 * (moved + moved.transpose(1, 0, 2)).reshape(9, count)
        linear = 2.0 * mu * strain
        linear[[0, 4, 8]] += lam * (strain[0] + strain[4] + strain[8])
        pulled_by_each(p - linear * volumes, slopes, found[:, s])
    return found


TIGHTER, TIGHTENINGS = 0.5, 6
"""By what the fit is tightened until motions held out are met, and how often."""


def held_out_cells(
    elements: ElementsAtRest,
    modes: np.ndarray,
    masses: np.ndarray,
    near: np.ndarray,
    hessian: Callable[[np.ndarray], np.ndarray],
    states: np.ndarray,
    held_out: np.ndarray,
    tolerance: float,
) -> tuple[ReducedEnergy, float]:
    """Choose few cells with weights above zero that pull as all elements do; return them and what they miss held out.

    modes, masses : (n, 3, r) and (r,), that mass does not couple; near : (n_elements,) bool, whose points are all
        candidates
    hessian : of the coordinates (r,), about the right one: it says how far a force moves the body
    states, held_out : coordinates (k, r) of motions that cells are fitted to, and of others
    What is missed is a displacement: that by which forces amiss would move the body, over its displacement, both in the
    norm of mass; RMS over the states fitted to, and of those held out the largest, which is at most ``tolerance``.
    The stiffness at rest is fitted alike. What cells lack of it is a matrix that does not turn with the body.
    Raises NotConverged where no choice meets motions held out.
    """
    r, count = len(masses), len(states)
    stiffness = products(modes, elements.multiply(modes))
    cells = some_points(elements, modes, near, np.random.default_rng(0))
    every, root = np.concatenate([states, held_out]), np.sqrt(masses)
    moves = [root[:, None] * np.linalg.inv(hessian(q)) / np.linalg.norm(root * q) for q in every]

    beyond = [-np.tensordot(elements.force(modes @ q), modes, 2) - stiffness @ q for q in every]
    wanted = np.array([move @ pull for move, pull in zip(moves, beyond, strict=True)])
    pulls = nonlinear_pulls(cells, elements.law, every)
    rows = np.einsum("sij,ksj->ski", np.array(moves), pulls).transpose(0, 2, 1)
    share, upper = np.sqrt(count / r), np.triu_indices(r)
    twice = share * np.where(upper[0] == upper[1], 1.0, np.sqrt(2.0))
    of_each = cells.stiffnesses()[:, *upper] * twice
    fitted = np.vstack([rows[:count].reshape(-1, len(pulls)), of_each.T]).T
    target = np.append(wanted[:count].ravel(), np.eye(r)[upper] * twice)
    enough = tolerance * np.sqrt(count) / np.linalg.norm(target)
    for _ in range(TIGHTENINGS):
        chosen, weights = few_of(fitted, target, enough)
        missed = np.linalg.norm(rows[count:, :, chosen] @ weights - wanted[count:], axis=1).max()
        if missed <= tolerance:
            return ReducedEnergy(cells.take(chosen, weights), np.zeros((r, 1)), elements.law), float(missed)
        enough *= TIGHTER
    raise NotConverged(
        f"cells of a reduced body misplace it by {missed:.2g} of its displacement in motions that they were not fitted "
        f"to, above {tolerance:g}; allow more, or take more vibrations",
        [float(missed)],
    )
