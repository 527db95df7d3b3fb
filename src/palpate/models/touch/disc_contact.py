"""Solve contact of an instrument with a linear body that is pressed on discs: which discs carry force, and how much.

The mean gap of each disc, weighted with its pressure, is zero where it carries a force, which is never negative: a
complementarity problem (Duriez and others 2006) in few compliances of the body, with the distance linearised anew.
"""

from typing import NamedTuple

import numba
import numpy as np

from palpate.effects.instrument import distances
from palpate.models.warped_response import warp

OFF, ITERATIONS = 1e-3, 30
"""Gaps that are left where discs bear, over the depth, and most linearisations, of which three are usual."""
BLOCKS = 5
"""Exchanges of many discs at once that may fail to leave fewer wrong ones, before they are exchanged one by one."""


class Discs(NamedTuple):
    """m discs on a surface, with their linear responses; gaps to an instrument are measured in s places.

    rest : (s, 3) [m]; ways : (m, 3) unit vectors along which the discs press
    motions : (m, s, 3) [m/N] of the places, by a unit force on each disc
    spins : (m, s, 3) [rad/N], the rotation vectors there, or none of them (0, s, 3) where motions are not turned
    shares : (m, s) of a disc's force in each place, rows that add up to 1; areas : (s,) [m²] of the places
    responses, turns : (m, n, 3) [m/N], [rad/N], the motions and the rotation vectors of the fine surface
    """

    rest: np.ndarray
    ways: np.ndarray
    motions: np.ndarray
    spins: np.ndarray
    shares: np.ndarray
    areas: np.ndarray
    responses: np.ndarray
    turns: np.ndarray


@numba.njit(cache=True, error_model="numpy")
def complementary(matrix, right, most):
    """Solve the linear complementarity problem: z ≥ 0, matrix z + right ≥ 0 (k,), one of both 0 in each row.

    matrix : (k, k), with positive principal minors; most : exchanges of rows at most
    Returns z and whether it was found. Block pivoting (Júdice and Pires 1994): rows with z < 0 or slack < 0 change
    between pressing and not, all at once while they become fewer; else the last one alone, which ends (Murty 1974).
    """
    k = len(right)
    pressing = np.ones(k, dtype=np.bool_)
    fewest, blocks, z = k + 1, BLOCKS, np.zeros(k)
    for _ in range(most):  # solve with the rows that press, then exchange wrong ones
        pressing_rows = np.flatnonzero(pressing)
        z[:] = 0.0
        if len(pressing_rows) > 0:
            pressing_block = np.empty((len(pressing_rows), len(pressing_rows)))
            for a in range(len(pressing_rows)):
                for b in range(len(pressing_rows)):
                    pressing_block[a, b] = matrix[pressing_rows[a], pressing_rows[b]]
            z[pressing_rows] = np.linalg.solve(pressing_block, -right[pressing_rows])
        wrong_count, last_wrong = 0, -1
        slack = np.dot(matrix, z) + right
        for i in range(k):
            if (pressing[i] and z[i] < 0.0) or (not pressing[i] and slack[i] < 0.0):
                wrong_count, last_wrong = wrong_count + 1, i
        if wrong_count == 0:
            return z, True
        if wrong_count < fewest:
            fewest, blocks = wrong_count, BLOCKS
        else:
            blocks -= 1
        for i in range(k):
            if (i == last_wrong) if blocks < 0 else (z[i] < 0.0 if pressing[i] else slack[i] < 0.0):
                pressing[i] = not pressing[i]
    return np.maximum(z, 0.0), False


@numba.njit(cache=True, error_model="numpy")
def settle_discs(rest, motions, spins, shares, tip, travel, steps, axes, shape):
    """Return the forces (m,) [N] of discs on a body that an instrument is pushed into, and the error of contact.

    rest, motions, spins, shares : as of ``Discs``; axes, shape : of the instrument
    tip : (3,) [m], of it at first touch; travel, steps : its motion from there (3,) [m], in so many steps
    The error is the largest gap of a disc with force, or overlap of one without, over the travel's length. Solved in
    one step the complementarity problem may have no solution; in several, one linearisation each is enough but for the
    last. Gaps of turned motions close along normals turned back; rotations are updated with each linearisation.
    """
    m, s = shares.shape
    forces, places, normal_u = np.zeros(m), rest.copy(), np.empty(s)
    gaps, normals, means = np.empty(s), np.empty((s, 3)), np.empty(m)
    turned, spin = len(spins) > 0, np.zeros((s, 3))
    length, error = max(np.sqrt(np.dot(travel, travel)), 1e-300), np.inf
    for step in range(1, steps + 1):
        linearisations = ITERATIONS if step == steps else 1
        for count in range(linearisations + 1):
            distances(places, tip + step / steps * travel, axes, shape, gaps, normals)
            # the error of contact
            means[:] = np.dot(shares, gaps)
            error = 0.0
            for i in range(m):
                error = max(error, abs(means[i]) if forces[i] > 0.0 else -means[i])
            if error <= OFF * length or count == linearisations:
                break
            # how forces of active discs, which bear or overlap, close their gaps, and their gaps without force
            active = np.flatnonzero((forces > 0.0) | (means < 0.0))
            k = len(active)
            unturned = warp(-spin, normals) if turned else normals
            closing, free_gaps = np.empty((k, k)), np.empty(k)
            for b in range(k):
                u = motions[active[b]]
                for n in range(s):
                    normal_u[n] = unturned[n, 0] * u[n, 0] + unturned[n, 1] * u[n, 1] + unturned[n, 2] * u[n, 2]
                for a in range(k):
                    closing[a, b] = np.dot(shares[active[a]], normal_u)
            for a in range(k):
                free_gaps[a] = means[active[a]]
                for b in range(k):
                    free_gaps[a] -= closing[a, b] * forces[active[b]]
            active_forces, solved = complementary(closing, free_gaps, 10 * k)
            if not solved:
                break
            # the surface places, moved by these forces
            forces[active] = active_forces
            places = combined(forces, motions)
            if turned:
                spin = combined(forces, spins)
                places = warp(spin, places)
            places += rest
    return forces, error / length


@numba.njit(cache=True, error_model="numpy")
def combined(forces, responses):
    """Return the sum (n, 3) of the rows of ``responses`` (m, n, 3) times ``forces`` (m,), most of which are 0."""
    total = np.zeros(responses.shape[1:])
    flat = total.ravel()
    for i in range(len(forces)):
        if forces[i] > 0.0:
            force, row = forces[i], responses[i].ravel()
            for n in range(len(flat)):
                flat[n] += force * row[n]
    return total
