"""Hyper-reduction: few cubature points with weights that are not negative, whose energy is that of all elements.

Candidates are the integration points of elements near a place, and means or some points of the other elements.
"""

from collections.abc import Callable, Sequence

import numpy as np

from palpate.effects.law import Law
from palpate.errors import NotConverged
from palpate.models.contact_modes.elements_at_rest import ElementsAtRest
from palpate.models.reduced.basis import products
from palpate.models.reduced.cubature_points import CubaturePoints, point_stresses, pulled_by_each
from palpate.models.reduced.energy import ReducedEnergy

FEW = 2000
"""Points beside those near a place that cubature points are chosen from; with all of them answers are no better."""


def rings_around(elements: ElementsAtRest, nodes: np.ndarray, rings: int) -> np.ndarray:
    """Return which elements (m,) bool touch ``nodes`` (k,) or lie in so many ``rings`` of elements around them."""
    marked = np.zeros(len(elements.rest), dtype=bool)
    marked[nodes] = True
    in_rings = marked[elements.couples].any(axis=1)
    for _ in range(rings):
        marked[elements.couples[in_rings]] = True
        in_rings = marked[elements.couples].any(axis=1)
    return in_rings


def points_and_means(
    elements: ElementsAtRest, modes: np.ndarray, exact: np.ndarray, together: int = 1
) -> CubaturePoints:
    """Return as cubature points all integration points of ``exact`` elements (m,) bool, and means of the others.

    modes : (n, 3, r)
    together : how many consecutive elements share one mean where none of them is exact: 1, or 8 if they come from split
        elements
    """
    with_exact = exact if together == 1 else np.repeat(exact.reshape(-1, together).any(axis=1), together)
    parts = [_integration_points(elements, modes, np.flatnonzero(np.repeat(exact, elements.points)))]
    for chosen, size in ((np.flatnonzero(with_exact & ~exact), 1), (np.flatnonzero(~with_exact), together)):
        if len(chosen):
            means = _with_gradients(elements, modes, chosen, elements.mean_gradients(chosen), elements.volumes[chosen])
            parts.append(_averaged(means, size))
    slopes, *fields = zip(*parts, strict=True)
    return CubaturePoints(np.concatenate(slopes, axis=1), *(np.concatenate(each) for each in fields))


def _averaged(points: CubaturePoints, together: int) -> CubaturePoints:
    """Return the means of ``together`` consecutive points each, weighted by their volumes."""
    if together == 1:
        return points
    volumes = points.volumes.reshape(-1, together)
    total = volumes.sum(axis=1)
    shares = volumes / total[:, None]
    slopes = np.einsum("ckjr,kj->ckr", points.slopes.reshape(9, *shares.shape, -1), shares)
    moduli = [(modulus.reshape(shares.shape) * shares).sum(axis=1) for modulus in (points.mu, points.lam)]
    return CubaturePoints(slopes, total, *moduli)


def candidate_points(
    elements: ElementsAtRest, modes: np.ndarray, near: np.ndarray, rng: np.random.Generator
) -> CubaturePoints:
    """Return as cubature points all points of the elements ``near`` (m,) bool, and FEW points of other elements.

    modes : (n, 3, r). The other points are drawn by ``rng``; all are taken if there are no more.
    """
    close = np.repeat(near, elements.points)
    others = np.flatnonzero(~close)
    drawn = rng.choice(others, min(FEW, len(others)), replace=False)
    return _integration_points(elements, modes, np.sort(np.append(np.flatnonzero(close), drawn)))


def _integration_points(elements: ElementsAtRest, modes: np.ndarray, numbers: np.ndarray) -> CubaturePoints:
    """Return integration points by their ``numbers`` (k,), counted element by element, as cubature points."""
    source, point = np.divmod(numbers, elements.points)
    gradients = elements.gradients_at(source, point)
    return _with_gradients(elements, modes, source, gradients, elements.volumes[source] / elements.points)


def _with_gradients(
    elements: ElementsAtRest, modes: np.ndarray, source: np.ndarray, gradients: np.ndarray, volumes: np.ndarray
) -> CubaturePoints:
    """Return cubature points in elements ``source`` (k,), where shape functions have ``gradients`` (k, a, 3) [1/m]."""
    (count, corners), r = gradients.shape[:2], modes.shape[2]
    moved = modes[elements.couples[source]].transpose(0, 2, 3, 1).reshape(count, 3 * r, corners)
    slopes = np.matmul(moved, gradients).reshape(count, 3, r, 3).transpose(0, 1, 3, 2)
    flat = slopes.reshape(count, 9, r).transpose(1, 0, 2)
    return CubaturePoints(np.ascontiguousarray(flat), volumes, *(modulus[source] for modulus in elements.moduli))


LEAST_COLUMN = 1e-6
"""Points whose pulls are smaller than this part of the largest are not taken: rounding would choose them, with huge
weights."""


def sparse_weights(pulls: np.ndarray, target: np.ndarray, tolerance: float) -> tuple[np.ndarray, np.ndarray]:
    """Return numbers (k,) and weights (k,) > 0 of few rows of ``pulls`` whose weighted sum is near ``target`` (m,).

    pulls : (n, m), the forces of each of n cubature points under training loads; target : (m,), the forces of all
        elements
    tolerance : of the remainder, relative to the target
    By non-negative least squares that end early (Lawson and Hanson 1974, chapter 23; Farhat, Chapman and Avery 2015,
    algorithm 1): the row that is most like the remainder is added, until the remainder is small.
    """
    size = np.linalg.norm(pulls, axis=1)
    size = np.where(size > LEAST_COLUMN * size.max(), size, np.inf)
    rough = pulls.T.astype(np.float32)  # enough to choose by, and half as long
    chosen: np.ndarray = np.empty(0, dtype=int)
    weights: np.ndarray = np.empty(0)
    remainder = target
    square, rhs = np.empty((0, 0)), np.empty(0)  # the products of the chosen with each other, and with the target
    while np.linalg.norm(remainder) > tolerance * np.linalg.norm(target) and len(chosen) < min(pulls.shape):
        likeness = (remainder.astype(np.float32) @ rough) / size
        likeness[chosen] = -np.inf  # none is taken twice
        added = int(np.argmax(likeness))
        if not likeness[added] > 0.0:
            break
        chosen, weights = np.append(chosen, added), np.append(weights, 0.0)
        row = pulls[chosen] @ pulls[added]
        row[-1] *= 1.0 + 1e-12  # so that nearly equal rows keep the products regular
        square, rhs = np.block([[square, row[:-1, None]], [row]]), np.append(rhs, pulls[added] @ target)
        while len(chosen):  # fit weights until none is negative
            fitted = np.linalg.solve(square, rhs)
            if fitted.min() > 0.0:
                weights = fitted
                break
            # go towards the fit until the first weight is zero, and leave out the rows of zero weight
            falling = fitted <= 0.0
            ratio = weights[falling] / np.maximum(weights[falling] - fitted[falling], 1e-300)
            weights = weights + ratio.min() * (fitted - weights)
            kept = weights > 1e-14 * max(float(weights.max()), 1e-300)
            if kept.all():
                kept[np.argmin(fitted)] = False
            chosen, weights, rhs, square = chosen[kept], weights[kept], rhs[kept], square[np.ix_(kept, kept)]
        remainder = target - weights @ pulls[chosen]
    return chosen, weights


def hyper_reduced(
    model: ReducedEnergy, states: np.ndarray, tolerance: float, wanted: np.ndarray | None = None
) -> ReducedEnergy:
    """Return ``model`` with few weighted points, whose forces at ``states`` (s, r) are those of all, to ``tolerance``.

    Only the nonlinear part of the forces is fitted, that of each state relative to its size; the linear part stays
    exact.
    wanted : (s, r), the nonlinear forces to fit, if they are others than those of all points of the model
    """
    pulls = nonlinear_pulls(model.points, model.law, states)
    sums = pulls.sum(axis=0) if wanted is None else wanted
    sizes = np.linalg.norm(sums, axis=1)[:, None]
    chosen, weights = sparse_weights((pulls / sizes).reshape(len(pulls), -1), (sums / sizes).ravel(), tolerance)
    return ReducedEnergy(model.points.take(chosen, weights), model.loads, model.law)


def energy_of_elements(
    elements: ElementsAtRest,
    modes: np.ndarray,
    near: np.ndarray,
    states: np.ndarray,
    tolerance: float,
    rng: np.random.Generator,
    loads: np.ndarray | None = None,
    moved: Sequence[np.ndarray] | None = None,
) -> ReducedEnergy:
    """Return the energy of few points, whose forces at ``states`` (s, r) of ``modes`` are those of all elements.

    near, rng : candidates, as in ``candidate_points``; tolerance : relative, as in ``hyper_reduced``
    loads : (r, f), unit forces in coordinates; moved : displacements (n, 3) [m] at the states, if modes do not span
        them
    """
    moved, count = [modes @ q for q in states] if moved is None else moved, modes.shape[2]
    pulls = -np.array([elements.force(each).ravel() for each in moved]) @ modes.reshape(-1, count) - states  # nonlinear
    loads = np.empty((count, 0)) if loads is None else loads
    model = ReducedEnergy(candidate_points(elements, modes, near, rng), loads, elements.law, np.zeros((count, count)))
    return hyper_reduced(model, states, tolerance, pulls)


def nonlinear_pulls(points: CubaturePoints, law: Law, states: np.ndarray) -> np.ndarray:
    """Return the nonlinear part of the gradient of each of k points' energies at ``states`` (s, r): (k, s, r)."""
    slopes, volumes, mu, lam = points
    count = len(volumes)
    flat, f, p = slopes.reshape(9 * count, -1), np.empty((9, count)), np.empty((9, count))
    energies, accepted = np.empty(count), np.empty(count, dtype=bool)
    pulls = np.empty((count, *states.shape))
    for s, q in enumerate(np.ascontiguousarray(states)):
        point_stresses(q, flat, volumes, mu, lam, *law, f, p, energies, accepted)
        gradient = f.reshape(3, 3, count) - np.eye(3)[:, :, None]
        strain = 0.5 * (gradient + gradient.transpose(1, 0, 2)).reshape(9, count)
        linear = 2.0 * mu * strain
        linear[[0, 4, 8]] += lam * (strain[0] + strain[4] + strain[8])
        pulled_by_each(p - linear * volumes, slopes, pulls[:, s])
    return pulls


TIGHTER, TIGHTENINGS = 0.5, 6
"""By what the fit is tightened until motions held out are met, and how often."""


def energy_for_motions(
    elements: ElementsAtRest,
    modes: np.ndarray,
    masses: np.ndarray,
    near: np.ndarray,
    hessian: Callable[[np.ndarray], np.ndarray],
    states: np.ndarray,
    held_out: np.ndarray,
    tolerance: float,
) -> tuple[ReducedEnergy, float]:
    """Choose few weighted cubature points that move a body as all elements do; return their energy and its error.

    modes, masses : (n, 3, r) and (r,), in which mass is diagonal; near : (n_elements,) bool, elements of which all
        points are candidates
    hessian : function of coordinates (r,), about the Hessian of the energy, which turns errors of forces into
        displacements
    states, held_out : coordinates (k, r) of motions that weights are fitted to, and of motions that they are not fitted
        to
    Errors are displacements over those of the body, both in the norm of mass. The RMS over ``states`` is made small;
    the largest over ``held_out`` is returned, and at most ``tolerance``. The stiffness at rest is fitted alike, as a
    correction of it would be a matrix that does not turn with the body. NotConverged where no choice of points
    suffices.
    """
    r, count = len(masses), len(states)
    stiffness = products(modes, elements.multiply(modes))
    points = candidate_points(elements, modes, near, np.random.default_rng(0))
    all_states, root = np.concatenate([states, held_out]), np.sqrt(masses)
    to_displacements = [root[:, None] * np.linalg.inv(hessian(q)) / np.linalg.norm(root * q) for q in all_states]
    # nonlinear forces as relative displacements: those of all elements, ``needed``, and of each point; with stiffness
    nonlinear_forces = [-np.tensordot(elements.force(modes @ q), modes, 2) - stiffness @ q for q in all_states]
    needed = np.array([move @ pull for move, pull in zip(to_displacements, nonlinear_forces, strict=True)])
    pulls = nonlinear_pulls(points, elements.law, all_states)
    displacements = np.einsum("sij,ksj->ski", np.array(to_displacements), pulls).transpose(0, 2, 1)
    share, upper = np.sqrt(count / r), np.triu_indices(r)
    entry_weights = share * np.where(upper[0] == upper[1], 1.0, np.sqrt(2.0))
    stiffness_rows = points.stiffnesses()[:, *upper] * entry_weights
    fitted = np.vstack([displacements[:count].reshape(-1, len(pulls)), stiffness_rows.T]).T
    target = np.append(needed[:count].ravel(), np.eye(r)[upper] * entry_weights)
    fit_tolerance = tolerance * np.sqrt(count) / np.linalg.norm(target)
    for _ in range(TIGHTENINGS):  # until motions that were not fitted to are met, too
        chosen, weights = sparse_weights(fitted, target, fit_tolerance)
        missed = np.linalg.norm(displacements[count:, :, chosen] @ weights - needed[count:], axis=1).max()
        if missed <= tolerance:
            return ReducedEnergy(points.take(chosen, weights), np.zeros((r, 1)), elements.law), float(missed)
        fit_tolerance *= TIGHTER
    raise NotConverged(
        f"cells of a reduced body misplace it by {missed:.2g} of its displacement in motions that they were not fitted "
        f"to, above {tolerance:g}; allow more, or take more vibrations",
        [float(missed)],
    )
