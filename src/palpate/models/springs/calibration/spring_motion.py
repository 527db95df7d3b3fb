"""Motion of a pressed spring network: explicit steps, for one choice of moduli or for several at a time.

For its derivative (adjoint.py): step s = 0 … steps − 1 is, exactly and in this order,

    k = ½ (E₁ + E₂) weight                                       (s,)  eq. 5
    μ = 2 ratio sqrt(k m₁m₂/(m₁ + m₂))                           (s,)  instead of eq. 6, see ``dampings``
    n = (x₂ − x₁)/l;  T = k (l − l₀) + μ n·(v₂ − v₁);  f₁ += T n;  f₂ −= T n        eq. 1, without rounding
    per tetrahedron, if volume_n_m > 0:  f_a −= κ (L − L₀)(u_a − ¼ Σu)             effects/volume_force.py
    f += press.factors(...)[s] · press.pattern(n)
    v ← v + h f(x, v)/m,  held nodes 0;  x ← x + h v             (the new v)

and the motion holds x and v after each step; key points are a fixed linear map of both.
"""

from dataclasses import dataclass

import numba
import numpy as np

from palpate.effects import kelvin
from palpate.effects.volume_force import add_forces, rest_distance_sum
from palpate.errors import InputError, NotConverged
from palpate.models.springs.calibration.spring_model import KeyPoints, Press, SpringModel

ALONE = (0,)
"""The lanes of a motion by itself. There are as many as the tuple has items, which numba knows when it compiles."""


@dataclass(frozen=True, eq=False)
class Settings:
    """Settings of a motion and of its comparison.

    step_s : [s]; steps : their number; damping_ratio : of critical damping of a pair of nodes
    volume_n_m : stiffness κ of the volume force [N/m], 0 for none; keys : points at which positions are recorded
    every : steps from one comparison to the next, which divides ``steps``
    """

    step_s: float
    steps: int
    damping_ratio: float
    keys: KeyPoints
    volume_n_m: float = 0.0
    every: int = 1

    def compared(self, motion: np.ndarray) -> np.ndarray:
        """Return where the key points are whenever they are compared, (steps/every, p, 3), from a ``trajectory``."""
        return self.keys.of(motion[self.every :: self.every])


def stiffnesses(model: SpringModel, young: np.ndarray) -> np.ndarray:
    """Compute k (…, s) [N/m] from moduli ``young`` (…, n) [Pa] (paper 2, eq. 5)."""
    return 0.5 * (young[..., model.pairs[:, 0]] + young[..., model.pairs[:, 1]]) * model.weights


def dampings(model: SpringModel, stiffness: np.ndarray, ratio: float) -> np.ndarray:
    """Compute μ (…, s) [N s/m] = 2 ratio sqrt(k m₁m₂/(m₁ + m₂)) of springs ``stiffness`` (…, s) [N/m].

    Not paper 2's eq. 6, 2 sqrt(k (m₁ + m₂))/l, whose unit is not N s/m. With l in metres it is 2/l times the critical
    damping of two equal nodes: some 800 times on a cube of 10 mm, where springs would need seconds to follow a
    press, and steps of microseconds.
    """
    return kelvin.dampings(model.pairs, stiffness, model.masses, ratio)


def simulate(model: SpringModel, young: np.ndarray, press: Press, settings: Settings) -> tuple[np.ndarray, np.ndarray]:
    """Compute positions [m] and velocities [m/s] of the key points when compared, both (steps/every, p, 3).

    ``young`` (n,) [Pa]. Raises NotConverged if they do not stay finite, InputError unless all moduli are positive.
    """
    positions, velocities = trajectory(model, young, press, settings)
    return settings.compared(positions), settings.compared(velocities)


def trajectory(
    model: SpringModel, young: np.ndarray, press: Press, settings: Settings
) -> tuple[np.ndarray, np.ndarray]:
    """Compute positions [m] and velocities [m/s] of all nodes, initially and after each step: (steps + 1, n, 3)."""
    if young.shape != model.masses.shape or not (young > 0.0).all():
        raise InputError(f"young of a spring network must be {len(model.masses)} positive numbers, one a node, in Pa.")
    stiffness = stiffnesses(model, young)
    x = np.empty((settings.steps + 1, *model.nodes.shape))
    v = np.empty_like(x)
    damping = dampings(model, stiffness, settings.damping_ratio)
    _record(x, v, stiffness[:, None], damping[:, None], *constants(model, press, settings))
    if not (np.isfinite(x).all() and np.isfinite(v).all()):
        raise NotConverged(
            f"press {press.name}: the motion diverges; take steps shorter than {settings.step_s:g} s", []
        )
    return x, v


def constants(model: SpringModel, press: Press, settings: Settings) -> tuple:
    """Collect the arguments of ``advance`` that no modulus changes, with the factors of the load in all steps."""
    mobility = 1.0 / model.masses
    mobility[model.held] = 0.0
    volume_rest = rest_distance_sum(model.nodes, model.tetrahedra)
    network = (model.nodes, model.pairs, model.rest_m, model.tetrahedra, volume_rest, float(settings.volume_n_m))
    load = press.pattern(len(model.nodes)), press.factors(settings.step_s, settings.steps)
    return *network, mobility, *load, settings.step_s


@numba.njit(cache=True, error_model="numpy")
def advance(
    x, v, force, work, stiffness, damping, pairs, rest, tetrahedra, volume_rest, volume, mobility, load, factor, h,
    lanes,
):  # fmt: skip
    """Advance k = len(lanes) motions by one step of symplectic Euler, in place.

    x, v : (n, 3k), of each node all x first, then all y and z; stiffness, damping : (s, k)
    force : (n, 3k) and work : (12k,), workspace, the second of which separates what is read from what is written, so
        that vector instructions do one lane each
    """
    k = len(lanes)
    force[:] = 0.0
    for e in range(len(pairs)):
        xa, xb, va, vb = x[pairs[e, 0]], x[pairs[e, 1]], v[pairs[e, 0]], v[pairs[e, 1]]
        stiff, damped, rest_length = stiffness[e], damping[e], rest[e]
        for i in range(k):
            d0, d1, d2 = xb[i] - xa[i], xb[k + i] - xa[k + i], xb[2 * k + i] - xa[2 * k + i]
            length = np.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
            rate = d0 * (vb[i] - va[i]) + d1 * (vb[k + i] - va[k + i]) + d2 * (vb[2 * k + i] - va[2 * k + i])
            tension = (stiff[i] * (length - rest_length) + damped[i] * (rate / length)) / length
            work[i], work[k + i], work[2 * k + i] = tension * d0, tension * d1, tension * d2
        first, second = force[pairs[e, 0]], force[pairs[e, 1]]
        for i in range(3 * k):
            first[i] += work[i]
            second[i] -= work[i]
    if volume > 0.0:
        add_forces(x, tetrahedra, volume_rest, volume, force, work, lanes)
    for a in range(len(x)):
        for i in range(3):
            push = factor * load[a, i]
            for j in range(i * k, (i + 1) * k):
                v[a, j] += h * mobility[a] * (force[a, j] + push)
                x[a, j] += h * v[a, j]


@numba.njit(cache=True, error_model="numpy")
def _record(
    x, v, stiffness, damping, nodes, pairs, rest, tetrahedra, volume_rest, volume, mobility, load, factors, h
):  # fmt: skip
    force, work = np.empty_like(nodes), np.empty(12)
    x[0], v[0] = nodes, 0.0
    for s in range(len(factors)):
        x[s + 1], v[s + 1] = x[s], v[s]
        advance(
            x[s + 1], v[s + 1], force, work, stiffness, damping, pairs, rest, tetrahedra, volume_rest, volume, mobility,
            load, factors[s], h, ALONE,
        )  # fmt: skip
