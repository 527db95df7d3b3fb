"""Adjoint of a spring network's motion: derivatives by all moduli at the cost of about two motions.

Backwards through the steps of spring_motion.py, with a = ∂L/∂x and b = ∂L/∂v of all that comes later:

    b += h a;  w = h b/m, 0 on held nodes;  a += (∂f/∂x)ᵀ w;  b += (∂f/∂v)ᵀ w;  ∂L/∂k += w·∂f/∂k, μ and κ alike

Trap: the whole motion must be stored, 48 bytes per node and step; the cube's 120 nodes need 6 kB per step.
"""

from dataclasses import dataclass

import numba
import numpy as np

from palpate.effects.volume_force import distance_sum
from palpate.models.springs.calibration import spring_motion
from palpate.models.springs.calibration.spring_model import Press, SpringModel
from palpate.models.springs.calibration.spring_motion import Settings


@dataclass(frozen=True, eq=False)
class Gradient:
    """Derivatives of a number that depends on a motion.

    young : (n,) by the modulus of each node [1/Pa]; volume : by the stiffness of the volume force [m/N]
    """

    young: np.ndarray
    volume: float


def pull_back(
    model: SpringModel,
    young: np.ndarray,
    press: Press,
    settings: Settings,
    motion: tuple[np.ndarray, np.ndarray],
    by_motion: tuple[np.ndarray, np.ndarray],
) -> Gradient:
    """Compute the derivatives of a number by the moduli from those by the key points' positions and velocities.

    motion : of spring_motion.trajectory; by_motion : two of (steps/every, p, 3), as spring_motion.simulate returns
    """
    (x, v), (by_x, by_v) = motion, by_motion
    stiffness = spring_motion.stiffnesses(model, young)
    damping = spring_motion.dampings(model, stiffness, settings.damping_ratio)
    by_stiffness, by_damping, by_volume = np.zeros_like(stiffness), np.zeros_like(stiffness), np.zeros(1)
    _, pairs, rest, tetrahedra, volume_rest, volume, mobility, _, _, h = spring_motion.constants(model, press, settings)
    _backwards(
        x, v, by_x, by_v, settings.every, settings.keys.corners, settings.keys.shares, stiffness, damping, pairs, rest,
        tetrahedra, volume_rest, volume, mobility, h, by_stiffness, by_damping, by_volume,
    )  # fmt: skip
    by_stiffness += by_damping * damping / (2.0 * stiffness)
    halves = np.repeat(0.5 * by_stiffness * model.weights, 2)
    return Gradient(np.bincount(pairs.ravel(), halves, minlength=len(young)), float(by_volume[0]))


@numba.njit(cache=True, error_model="numpy")
def _backwards(
    x, v, by_x, by_v, every, corners, shares, stiffness, damping, pairs, rest, tetrahedra, volume_rest, volume,
    mobility, h, by_stiffness, by_damping, by_volume,
):  # fmt: skip
    """Step backwards through the motion; add to the last three arrays, (s,), (s,) and (1,)."""
    a, b, w = np.zeros_like(x[0]), np.zeros_like(x[0]), np.empty_like(x[0])
    for s in range(len(x) - 2, -1, -1):
        frame = s // every
        for p in range(len(corners) if (s + 1) % every == 0 else 0):
            for c in range(4):
                for i in range(3):
                    a[corners[p, c], i] += shares[p, c] * by_x[frame, p, i]
                    b[corners[p, c], i] += shares[p, c] * by_v[frame, p, i]
        for node in range(len(w)):
            for i in range(3):
                b[node, i] += h * a[node, i]
                w[node, i] = h * mobility[node] * b[node, i]
        _through_springs(x[s], v[s], w, stiffness, damping, pairs, rest, a, b, by_stiffness, by_damping)
        if volume > 0.0:
            _through_volume(x[s], w, tetrahedra, volume_rest, volume, a, by_volume)


@numba.njit(cache=True, error_model="numpy")
def _through_springs(x, v, w, stiffness, damping, pairs, rest, a, b, by_stiffness, by_damping):
    """Add a step's derivatives through the springs.

    w·f of a spring is T n·d with d = w₁ − w₂; its derivatives by the second end are minus those by the first.
    """
    n, d, rate_by = np.empty(3), np.empty(3), np.empty(3)
    for e in range(len(pairs)):
        first, second = pairs[e, 0], pairs[e, 1]
        length = 0.0
        for i in range(3):
            n[i] = x[second, i] - x[first, i]
            length += n[i] * n[i]
        length = np.sqrt(length)
        rate = along = 0.0
        for i in range(3):
            n[i] /= length
            rate_by[i] = v[second, i] - v[first, i]
            d[i] = w[first, i] - w[second, i]
            rate += n[i] * rate_by[i]
            along += n[i] * d[i]
        stretch = length - rest[e]
        tension = stiffness[e] * stretch + damping[e] * rate
        by_stiffness[e] += stretch * along
        by_damping[e] += rate * along
        for i in range(3):
            rotation = damping[e] * along * (rate_by[i] - rate * n[i]) + tension * (d[i] - along * n[i])
            by_end = stiffness[e] * along * n[i] + rotation / length
            a[second, i] += by_end
            a[first, i] -= by_end
            b[second, i] += damping[e] * along * n[i]
            b[first, i] -= damping[e] * along * n[i]


@numba.njit(cache=True, error_model="numpy")
def _through_volume(x, w, tetrahedra, volume_rest, volume, a, by_volume):
    """Add a step's derivatives through the volume force.

    w·f of a tetrahedron is −κ (L − L₀) g·w with g = ∂L/∂x; its Hessian is symmetric, so it is its own transpose.
    """
    lengths, u, projected = np.empty(4), np.empty((8, 3)), np.empty((4, 3))
    for e in range(len(tetrahedra)):
        stretch = distance_sum(x, tetrahedra[e], lengths, u) - volume_rest[e]
        along = 0.0
        for c in range(4):
            for i in range(3):
                along += u[4 + c, i] * w[tetrahedra[e, c], i]
        by_volume[0] -= stretch * along
        for i in range(3):
            mean = 0.0
            for c in range(4):
                mean += 0.25 * w[tetrahedra[e, c], i]
            for c in range(4):
                projected[c, i] = w[tetrahedra[e, c], i] - mean
        for c in range(4):
            out = 0.0
            for i in range(3):
                out += u[c, i] * projected[c, i]
            for i in range(3):
                projected[c, i] = (projected[c, i] - out * u[c, i]) / lengths[c] if lengths[c] > 0.0 else 0.0
        for i in range(3):
            mean = 0.25 * (projected[0, i] + projected[1, i] + projected[2, i] + projected[3, i])
            for c in range(4):
                change = along * u[4 + c, i] + stretch * (projected[c, i] - mean)
                a[tetrahedra[e, c], i] -= volume * change
