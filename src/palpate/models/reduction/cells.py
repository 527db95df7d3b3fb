"""Cells over which a reduced energy is taken: points of elements near a contact, averages of elements elsewhere."""

from typing import NamedTuple

import numpy as np

from palpate.models.reduction.elements_at_rest import ElementsAtRest


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
        _, count, modes = self.slopes.shape
        f = self.slopes.reshape(3, 3, count, modes)
        strain = 0.5 * (f + f.transpose(1, 0, 2, 3)).reshape(9, count, modes)
        trace = strain[0] + strain[4] + strain[8]
        found = trace.T @ ((self.volumes * self.lam)[:, None] * trace)
        for part in strain:
            found += part.T @ ((2.0 * self.volumes * self.mu)[:, None] * part)
        return found


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
    slopes = _slopes(modes, elements.couples[source], gradients)
    flat = slopes.reshape(len(source), 9, modes.shape[2]).transpose(1, 0, 2)
    return Cells(np.ascontiguousarray(flat), volumes, *(modulus[source] for modulus in elements.moduli))


def _slopes(modes: np.ndarray, couples: np.ndarray, gradients: np.ndarray) -> np.ndarray:
    """Return ∂F/∂q (k, 3, 3, r) of k points; couples : (k, a), gradients : (k, a, 3) [1/m]."""
    (count, corners), wide = couples.shape, modes.shape[2]
    moved = modes[couples].transpose(0, 2, 3, 1).reshape(count, 3 * wide, corners)
    return np.matmul(moved, gradients).reshape(count, 3, wide, 3).transpose(0, 1, 3, 2)
