"""Contact of an instrument with a linear body that is pressed on discs: which of them bear, and how much.

The mean gap of each disc, weighted with its pressure, is none where it bears a force, which is never negative: a
complementarity problem (Duriez and others 2006) in a few of the body's compliances, with the distance linearised anew.
"""

from typing import NamedTuple

import numba
import numpy as np

from palpate.effects.instrument import distances

OFF, ITERATIONS = 1e-3, 30
"""Gaps that are left where discs bear, over the depth, and most linearisations, of which three are usual."""
BLOCKS = 5
"""Exchanges of many discs at once that may fail to leave fewer wrong ones, before they are exchanged one by one."""


class Discs(NamedTuple):
    """m discs on a surface, whose gaps are looked at in s places.

    rest : (s, 3) [m]; motions : (m, s, 3) [m/N] of the places, by a unit force on each disc
    shares : (m, s) of a disc's force in each place, rows that add up to 1; areas : (s,) [m²] of the places
    responses : (m, n) [m/N] of whatever is asked for
    """

    rest: np.ndarray
    motions: np.ndarray
    shares: np.ndarray
    areas: np.ndarray
    responses: np.ndarray


@numba.njit(cache=True, error_model="numpy")
def complementary(matrix, right, most):
    """Return numbers z (k,) ≥ 0 with matrix z + right ≥ 0, one of both 0 everywhere, and whether they were found.

    matrix : (k, k), with positive principal minors; most : exchanges. Block pivoting (Júdice and Pires 1994): all that
    are wrong change sides while they become fewer; else one by one, which ends (Murty 1974).
    """
    k = len(right)
    bears = np.ones(k, dtype=np.bool_)
    fewest, blocks, z = k + 1, BLOCKS, np.zeros(k)
    for _ in range(most):
        on = np.flatnonzero(bears)
        z[:] = 0.0
        if len(on) > 0:
            square = np.empty((len(on), len(on)))
            for a in range(len(on)):
                for b in range(len(on)):
                    square[a, b] = matrix[on[a], on[b]]
            z[on] = np.linalg.solve(square, -right[on])
        wrong, last = 0, -1
        left = np.dot(matrix, z) + right
        for i in range(k):
            if (bears[i] and z[i] < 0.0) or (not bears[i] and left[i] < 0.0):
                wrong, last = wrong + 1, i
        if wrong == 0:
            return z, True
        if wrong < fewest:
            fewest, blocks = wrong, BLOCKS
        else:
            blocks -= 1
        for i in range(k):
            if (i == last) if blocks < 0 else (z[i] < 0.0 if bears[i] else left[i] < 0.0):
                bears[i] = not bears[i]
    return np.maximum(z, 0.0), False


@numba.njit(cache=True, error_model="numpy")
def settle_discs(rest, motions, shares, tip, way, steps, axes, shape):
    """Return the forces (m,) [N] of discs on a body that an instrument is pushed into, and what is off.

    rest, motions, shares : as of ``Discs``; axes, shape : of the instrument; tip : (3,) [m], of it at first touch
    way, steps : how it then moves (3,) [m], in so many steps
    What is off is the largest gap of a disc that bears, or overlap of one that does not, over the way's length.
    """
    m, s = shares.shape
    forces, at, along = np.zeros(m), rest.copy(), np.empty(s)
    gaps, normals, means = np.empty(s), np.empty((s, 3)), np.empty(m)
    length, off = max(np.sqrt(np.dot(way, way)), 1e-300), np.inf
    for step in range(1, steps + 1):
        for count in range(ITERATIONS + 1):
            distances(at, tip + step / steps * way, axes, shape[0], shape[1], shape[2], shape[3], gaps, normals)
            means[:] = np.dot(shares, gaps)
            off = 0.0
            for i in range(m):
                off = max(off, abs(means[i]) if forces[i] > 0.0 else -means[i])
            if off <= OFF * length or count == ITERATIONS:
                break
            near = np.flatnonzero((forces > 0.0) | (means < 0.0))
            k = len(near)
            closing, right = np.empty((k, k)), np.empty(k)
            for b in range(k):
                moved = motions[near[b]]
                for n in range(s):
                    along[n] = normals[n, 0] * moved[n, 0] + normals[n, 1] * moved[n, 1] + normals[n, 2] * moved[n, 2]
                for a in range(k):
                    closing[a, b] = np.dot(shares[near[a]], along)
            for a in range(k):
                right[a] = means[near[a]]
                for b in range(k):
                    right[a] -= closing[a, b] * forces[near[b]]
            found, _ = complementary(closing, right, 10 * k)
            at[:] = rest
            for a in range(k):
                forces[near[a]] = found[a]
                if found[a] > 0.0:
                    at += found[a] * motions[near[a]]
    return forces, off / length


@numba.njit(cache=True, error_model="numpy")
def combined(forces, responses):
    """Return the sum (n,) of the rows of ``responses`` (m, n) times ``forces`` (m,), most of which are 0."""
    total = np.zeros(responses.shape[1])
    for i in range(len(forces)):
        if forces[i] > 0.0:
            force, row = forces[i], responses[i]
            for n in range(len(total)):
                total[n] += force * row[n]
    return total
