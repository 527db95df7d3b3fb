"""Answer with the compliance of the whole body, enriched by functions that jump across the cut: nothing is remeshed.

The displacement is that of the uncut elements plus Σ N_i ψ d_i over the corners i around the cut (Belytschko and Black
1999; Moës, Dolbow and Belytschko 1999): N_i are linear shape functions, and ψ = ± √((r + w) / 2), where w is how far a
place is inside the patch and r its distance from the front, is the opening that a crack's front has, √r sin(θ/2). So a
front may end inside an element. The stiffness K of the uncut elements stays, and the few d follow from the Schur
complement D − Bᵀ K⁻¹ B, with K⁻¹ prepared before anyone knows where the blade will go.
"""

from collections.abc import Sequence

import numba
import numpy as np
from scipy import sparse
from scipy.linalg import cho_factor, cho_solve
from scipy.spatial import cKDTree

from palpate.benchmark.cut_truth import Pulled, skin_map, with_patches
from palpate.benchmark.load import Refused
from palpate.bodies.cutting.cut import Cut
from palpate.bodies.cutting.ways import LEAST_SHARE, NEAR_PLANE, divide
from palpate.bodies.mesh import TetMesh, unit
from palpate.bodies.refinement import QUADRATURE_POINTS, quadratic_gradients, ten_nodes, with_midpoints
from palpate.effects.elements import PLAIN_POISSON, largest_poisson, shape_gradients
from palpate.effects.linear_elements import LinearElements
from palpate.effects.quadratic_elements import QuadraticElements
from palpate.errors import NotConverged
from palpate.linalg.block_pattern import hold
from palpate.linalg.multigrid import Factor
from palpate.models.cut.linear import TOGETHER
from palpate.models.cut.opened import CutCase
from palpate.models.fem_statics import coordinates_of

LARGEST = 4500
"""Nodes up to which the compliance of all of them is kept, of 730 MB in single precision."""
FLAT = 1e-9
"""Share of an element's volume below which a part of it is none."""
INSIDE = 0.7
"""Part of the way from the middle of a section to its corners where it is probed, too, whether the patch is there."""
ROWS = 32
"""Nodes whose rows are gathered at once, so that they stay in the cache."""
LOOSE = 1e-5
"""Least pivot of the Schur complement over the stiffness that opens the lips, below which nothing holds a piece."""


class Enriched:
    """Elements of ``order`` 1 or 2 on a level as it is at rest, with the finest triangles where hooks grasp.

    Raises Refused where the compliance would be too large, elements would lock, or the body lies on a bed.
    """

    def __init__(self, case: CutCase, level: int, order: int):
        self.case = case
        if case.body.bed is not None:
            raise Refused("a body on a bed is not cut")
        if largest_poisson(case.body.tissue(level)) > PLAIN_POISSON:
            raise Refused(f"plain elements lock above a Poisson's ratio of {PLAIN_POISSON}")
        body = with_patches(case.body, case.hooks, level)
        finest = len(body.levels) - 1
        mesh = body.fine
        assert isinstance(mesh, TetMesh)
        self._mesh = mesh
        body = with_midpoints(body, finest) if order == 2 else body
        elements_mesh, tissue = body.levels[finest + order - 1], body.tissue(finest)
        if (count := len(elements_mesh.nodes)) > LARGEST:
            raise Refused(f"the compliance of {count} nodes takes {36e-9 * count**2:.1f} GB")
        elements = (QuadraticElements if order == 2 else LinearElements)(mesh, tissue)
        self._gradients, self._moduli = elements.gradients, np.stack(elements.moduli)
        # the gradients of all shape functions, which are linear in an element, at its corners (4, nodes, 4 corners)
        self._slopes = quadratic_gradients(np.eye(4)) if order == 2 else np.tile(np.eye(4), (4, 1, 1))
        hooked = [hook.patch.nodes_of(elements_mesh) for hook in case.hooks]
        held = np.isin(np.arange(count), np.concatenate([body.anchors[finest + order - 1], *hooked]))
        self._held = held[: len(mesh.nodes)]
        matrix = elements.stiffness(elements_mesh.nodes)
        full = sparse.csr_array(matrix)
        hold(matrix.indptr, matrix.indices, matrix.data, held)
        factor = Factor(matrix)
        # what each hook does, moved by 1 m along its way
        self._pulls = np.zeros((len(hooked), count, 3))
        for pull, nodes, hook in zip(self._pulls, hooked, case.hooks, strict=True):
            pull[nodes] = unit(hook.shift_m)
            load = -(full @ pull.ravel()).reshape(-1, 3)
            load[held] = 0.0
            pull += factor.solve(load)
        lengths = [float(np.linalg.norm(hook.shift_m)) for hook in case.hooks]
        self._before = np.tensordot(lengths, self._pulls, axes=1)
        self._forces = np.tensordot(self._pulls, (full @ self._before.ravel()).reshape(-1, 3))
        # neighbours are neighbours in memory, too
        ordered = cKDTree(elements_mesh.nodes).indices
        rank = np.argsort(ordered)
        self._nodes = rank[ten_nodes(mesh) if order == 2 else mesh.tetrahedra]
        self._pulls, self._before = self._pulls[:, ordered], self._before[ordered]
        self._read(order, ordered)
        self._solve_for_all(factor, ordered, held)

    def _read(self, order: int, ordered: np.ndarray) -> None:
        """Prepare the interpolation to the places where answers are read, and the shape functions N_i there."""
        case, mesh = self.case, self._mesh
        side = np.zeros(len(mesh.triangles))
        self._linear = skin_map(mesh, side, case.seen, 1.0, degree=1)
        rows = skin_map(mesh, side, case.seen, 1.0) if order == 2 else self._linear
        rows = sparse.csr_array(rows[:, ordered])
        self._seen = np.unique(rows.indices)
        self._rows = sparse.csr_array(rows[:, self._seen])

    def _solve_for_all(self, factor: Factor, ordered: np.ndarray, held: np.ndarray) -> None:
        """Compute the compliance [m/N] of all nodes, (3n, 3n), and that of the s nodes that are read, (3n, s, 3)."""
        count, ranked = len(held), np.flatnonzero(~held[ordered])
        self._compliance = np.zeros((3 * count, 3 * count), dtype=np.float32)
        for part in np.array_split(ranked, max(1, 3 * len(ranked) // TOGETHER)):
            units = np.zeros((count, 3, len(part), 3))
            units[ordered[part], :, np.arange(len(part))] = np.eye(3)
            responses = factor.solve(units.reshape(count, 3, -1))[ordered].reshape(3 * count, -1)
            self._compliance[coordinates_of(part)] = responses.T
        self._shown = np.ascontiguousarray(self._compliance.reshape(-1, count, 3)[:, self._seen])

    def cut(self, cuts: Sequence[Cut]) -> None:
        """Divide elements along the cut, integrate the enrichment, and factorise the Schur complement of its jumps."""
        if len(cuts) != 1:
            raise Refused("one cut is followed at a time")
        cut = cuts[0]
        # parts of the elements that the cut divides, and the elements beside them
        corners, nodes = self._mesh.tetrahedra, self._mesh.nodes
        corner_above = (cut.across(nodes) >= 0.0)[corners]
        mixed = np.flatnonzero(corner_above.any(axis=1) & ~corner_above.all(axis=1))
        parts, owner, crossed = self._divided(cut, mixed)
        beside = np.asarray(np.isin(corners, corners[crossed]).any(axis=1))
        beside[mixed] = False
        parts, owner = np.concatenate([nodes[corners[beside]], parts]), np.append(np.flatnonzero(beside), owner)
        slopes, volumes = shape_gradients(TetMesh(parts.reshape(-1, 3), np.arange(4 * len(parts)).reshape(-1, 4)))
        volumes, sign = np.abs(volumes), np.where(cut.across(parts.mean(axis=1)) >= 0.0, 1.0, -1.0)
        # corners where the lips open, and integrals of the enrichment over the parts around them
        opened = self._opened(crossed, owner, volumes, sign)
        self._number = np.where(opened, np.cumsum(opened) - 1, -1)
        self._count = int(opened.sum())
        opens = np.flatnonzero(opened[corners].any(axis=1))
        used = opened[corners[owner]].any(axis=1)
        corners_m = parts[used].reshape(-1, 3)
        values = np.stack([np.abs(cut.across(corners_m)), cut.within(corners_m)], axis=1).reshape(-1, 4, 2)
        number = np.zeros(len(corners), dtype=np.int64)
        number[opens] = np.arange(len(opens))
        moments, products = integrals(
            parts[used], number[owner[used]], values, np.swapaxes(values, 1, 2) @ slopes[used], volumes[used],
            sign[used], nodes[corners[opens, 0]], self._gradients[opens], QUADRATURE_POINTS,
        )  # fmt: skip
        # stiffness between nodes and jumps, and among jumps, and its Schur complement
        near_nodes = self._nodes[opens]
        self._around = np.unique(near_nodes)
        moduli = np.ascontiguousarray(self._moduli[:, opens])
        places = np.searchsorted(self._around, near_nodes), self._number[corners[opens]]
        coupling, opening = assembled(
            moments, products, self._slopes, self._gradients[opens], moduli, *places, len(self._around), self._count
        )
        self._coupling = coupling.astype(np.float32)
        self.opening_stiffness = opening
        schur = opening - self._coupling.T @ product_of(self._compliance, self._around, self._coupling)
        self._jumps = self._jumping(cut)
        self._scale = 1.0 / np.sqrt(np.diag(opening))
        try:
            self._factor = cho_factor(self._scale[:, None] * schur * self._scale, lower=True)
        except np.linalg.LinAlgError:
            raise NotConverged("the lips are not held", [float("nan")]) from None
        if self._count and np.diag(self._factor[0]).min() ** 2 < LOOSE:
            raise NotConverged("nothing holds a piece that is cut free", [float("nan")])

    def pull(self) -> Pulled:
        """Return displacements where they are read, and the hooks' forces, with the lips of the cut free of force.

        From the uncut answer u, the jumps are d = -(D - B^T K^-1 B)^-1 B^T u; displacements are u - K^-1 B d, plus the
        enrichment times d, and the hooks' forces change by their answers to the load B d.
        """
        pulls = self._pulls[:, self._around].reshape(len(self._pulls), -1)
        uncut = self._before[self._around].ravel()
        jumps = -self._scale * cho_solve(self._factor, self._scale * (uncut @ self._coupling))
        load = self._coupling @ jumps  # B d [N]
        moved = self._before[self._seen] - combined(self._shown, self._around, load.astype(np.float32))
        moved = self._rows @ moved + self._jumps @ jumps.reshape(-1, 3)
        return Pulled(*self.case.parted(moved), self._forces + pulls @ load)

    def _jumping(self, cut: Cut) -> sparse.csr_array:
        """Return the values (points, jumps) of the enrichment N_i ψ at the places where answers are read."""
        rows = self._linear
        point, columns = np.repeat(np.arange(rows.shape[0]), np.diff(rows.indptr)), self._number[rows.indices]
        used = np.flatnonzero(columns >= 0)
        open_places, row = np.unique(point[used], return_inverse=True)
        across, within = cut.across(self.case.seen[open_places]), cut.within(self.case.seen[open_places])
        psi = np.sqrt(0.5 * np.maximum(np.hypot(across, within) + within, 0.0)) * self.case.sides([cut])[open_places, 0]
        return sparse.csr_array(
            (psi[row] * rows.data[used], (point[used], columns[used])), shape=(rows.shape[0], self._count)
        )

    def _opened(self, crossed: np.ndarray, owner: np.ndarray, volumes: np.ndarray, sign: np.ndarray) -> np.ndarray:
        """Return the corners (n,) bool at which lips may open: those of ``crossed`` elements with tissue on both sides.

        owner, volumes, sign : of the parts of divided elements, their elements, volumes [m³], and sides of the cut
        """
        corners, opened = self._mesh.tetrahedra, ~self._held
        around, shares, count = corners[owner].ravel(), np.repeat(volumes, 4), len(opened)
        sides = [np.bincount(around, shares * np.repeat(sign == side, 4), minlength=count) for side in (1.0, -1.0)]
        opened &= np.minimum(*sides) > LEAST_SHARE * np.add(*sides)
        return opened & np.isin(np.arange(count), corners[crossed])

    def _divided(self, cut: Cut, mixed: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Divide the elements ``mixed``, which have corners on both sides, by the cut's surface.

        Returns the parts, tetrahedra (n, 4, 3) [m], the element that each is of (n,), and the elements that the cut's
        patch crosses.
        """
        mesh = self._mesh
        parts, owner, crossed = mesh.nodes[mesh.tetrahedra[mixed]], mixed, [mixed[:0]]
        for piece in cut.pieces:  # divide along each surface in turn
            parts, owner, sections, section_owner = divide(parts, owner, piece.across(parts.reshape(-1, 3)))
            middle = sections.mean(axis=1, keepdims=True)
            probed = np.concatenate([middle, sections, middle + INSIDE * (sections - middle)], axis=1)
            inside = (cut.within(probed.reshape(-1, 3)) > 0.0).reshape(probed.shape[:2]).any(axis=1)
            on_cut = np.abs(cut.across(middle[:, 0])) <= NEAR_PLANE * mesh.size
            crossed.append(section_owner[on_cut & inside])
        solid = np.abs(np.linalg.det(parts[:, 1:] - parts[:, :1])) > 6.0 * FLAT * mesh.volumes[owner]
        return parts[solid], owner[solid], np.unique(np.concatenate(crossed))


@numba.njit(cache=True, error_model="numpy")
def integrals(parts, owner, values, slopes, volumes, sign, firsts, gradients, points):
    """Integrate the gradients of N_a ψ, shape functions times opening, over elements, by parts (n, 4, 3) [m] of them.

    owner, volumes, sign : (n,) whose parts they are, their volumes [m³], and on which side of the cut
    values, slopes : (n, 4, 2), (n, 2, 3) |across| and within [m] at the parts' corners, and their gradients
    firsts, gradients : (m, 3), (m, 4, 3) the elements' first corners [m], and the gradients of N_a [1/m]
    points : (q, 4) barycentric coordinates in a part, of equal weight
    Returns moments (m, 4, 4, 3), ∫ N_c ∇(N_a ψ), and products (m, 4, 4, 3, 3), ∫ ∇(N_a ψ) ∇(N_b ψ)ᵀ.
    """
    moments, products = np.zeros((len(firsts), 4, 4, 3)), np.zeros((len(firsts), 4, 4, 3, 3))
    place, shape_values, jump_gradients = np.empty(3), np.empty(4), np.empty((4, 3))
    for p in range(len(parts)):
        e, weight = owner[p], volumes[p] / len(points)
        for q in range(len(points)):
            across = within = 0.0
            place[:] = 0.0
            for k in range(4):
                across += points[q, k] * values[p, k, 0]
                within += points[q, k] * values[p, k, 1]
                for j in range(3):
                    place[j] += points[q, k] * parts[p, k, j]
            for a in range(4):
                shape_values[a] = 1.0 if a == 0 else 0.0
                for j in range(3):
                    shape_values[a] += gradients[e, a, j] * (place[j] - firsts[e, j])
            r = np.hypot(across, within)
            if within >= 0.0:
                psi = np.sqrt(0.5 * (r + within))
                conjugate = 0.5 * across / psi
            else:
                conjugate = np.sqrt(0.5 * (r - within))
                psi = 0.5 * across / conjugate
            for a in range(4):
                for j in range(3):
                    psi_slope = (conjugate * slopes[p, 0, j] + psi * slopes[p, 1, j]) / (2.0 * r)
                    jump_gradients[a, j] = sign[p] * (psi * gradients[e, a, j] + shape_values[a] * psi_slope)
            for a in range(4):
                for j in range(3):
                    for c in range(4):
                        moments[e, c, a, j] += weight * shape_values[c] * jump_gradients[a, j]
                    for b in range(4):
                        for i in range(3):
                            products[e, a, b, j, i] += weight * jump_gradients[a, j] * jump_gradients[b, i]
    return moments, products


@numba.njit(cache=True, error_model="numpy")
def assembled(moments, products, slopes, gradients, moduli, nodes, numbers, count, jumps):
    """Sum over elements the stiffness [N/m] between nodes and jumps, (3 count, 3 jumps), and among the jumps.

    slopes : (4, k, 4) of the elements' k functions at their corners, by barycentric coordinates; moduli : (2, m) μ, λ
    nodes : (m, k) in which rows they are; numbers : (m, 4) of the jumps of corners, -1 for none
    """
    coupling, opening = np.zeros((3 * count, 3 * jumps)), np.zeros((3 * jumps, 3 * jumps))
    node_gradients, outer = np.empty((4, 3)), np.empty((3, 3))
    for e in range(len(nodes)):
        mu, lam = moduli[0, e], moduli[1, e]
        for n in range(nodes.shape[1]):
            for c in range(4):
                for i in range(3):
                    node_gradients[c, i] = 0.0
                    for k in range(4):
                        node_gradients[c, i] += slopes[c, n, k] * gradients[e, k, i]
            for a in range(4):
                if numbers[e, a] < 0:
                    continue
                outer[:] = 0.0
                for c in range(4):
                    for i in range(3):
                        for j in range(3):
                            outer[i, j] += node_gradients[c, i] * moments[e, c, a, j]
                _add(outer, mu, lam, coupling, 3 * nodes[e, n], 3 * numbers[e, a])
        for a in range(4):
            for b in range(4):
                if numbers[e, a] >= 0 and numbers[e, b] >= 0:
                    _add(products[e, a, b], mu, lam, opening, 3 * numbers[e, a], 3 * numbers[e, b])
    return coupling, opening


@numba.njit(cache=True, error_model="numpy")
def _add(outer, mu, lam, matrix, row, column):
    """Add the stiffness of two functions, of whose gradients ``outer`` (3, 3) is the integrated product."""
    trace = outer[0, 0] + outer[1, 1] + outer[2, 2]
    for i in range(3):
        for j in range(3):
            matrix[row + i, column + j] += lam * outer[i, j] + mu * outer[j, i]
        matrix[row + i, column + i] += mu * trace


@numba.njit(cache=True)
def product_of(matrix, nodes, right):
    """Return the block (3k, 3k) of ``matrix`` (3n, 3n) between ``nodes`` (k,), times ``right`` (3k, p): (3k, p)."""
    product, rows = np.empty_like(right), np.empty((3 * ROWS, len(right)), dtype=right.dtype)
    for begin in range(0, len(nodes), ROWS):
        count = min(ROWS, len(nodes) - begin)
        for a in range(count):
            for i in range(3):
                row = 3 * nodes[begin + a] + i
                for b in range(len(nodes)):
                    for j in range(3):
                        rows[3 * a + i, 3 * b + j] = matrix[row, 3 * nodes[b] + j]
        product[3 * begin : 3 * (begin + count)] = np.dot(rows[: 3 * count], right)
    return product


@numba.njit(cache=True, fastmath=True)
def combined(rows, nodes, factors):
    """Return the sum (s, 3) of the rows of ``nodes`` (k,) in ``rows`` (3n, s, 3) times ``factors`` (3k,)."""
    total = np.zeros(rows.shape[1] * 3, dtype=rows.dtype)
    for a in range(len(nodes)):
        for i in range(3):
            row, factor = rows[3 * nodes[a] + i].ravel(), factors[3 * a + i]
            for s in range(len(total)):
                total[s] += factor * row[s]
    return total.reshape(-1, 3)
