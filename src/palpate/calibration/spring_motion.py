"""Motion of a pressed spring network: explicit steps, for one choice of moduli or for a population.

For its derivative (adjoint.py): step s = 0 … steps − 1 is, exactly and in this order,

    k = ½ (E₁ + E₂) weight                                       (s,)  eq. 5
    μ = 2 ratio sqrt(k m₁m₂/(m₁ + m₂))                           (s,)  instead of eq. 6, see ``dampings``
    n = (x₂ − x₁)/l;  T = k (l − l₀) + μ n·(v₂ − v₁);  f₁ += T n;  f₂ −= T n        eq. 1, without rounding
    per tetrahedron, if volume_n_m > 0:  f_a −= κ (L − L₀)(u_a − ¼ Σu)             effects/volume_force.py
    f[press.node] += press.factors(...)[s] · force_n
    v ← v + h f(x, v)/m,  held nodes 0;  x ← x + h v             (the new v)

and the motion holds x and v after each step; key points are a fixed linear map of both.
"""

from dataclasses import dataclass

import numba
import numpy as np

from palpate.calibration.spring_model import KeyPoints, Press, SpringModel
from palpate.effects import kelvin
from palpate.effects.volume_force import add_force, rest_distance_sum
from palpate.errors import InputError, NotConverged


@dataclass(frozen=True, eq=False)
class Settings:
    """Settings of a motion and of its comparison.

    step_s : [s]; steps : their number; damping_ratio : of critical damping of a pair of nodes
    volume_n_m : stiffness κ of the volume force [N/m], 0 for none; keys : points at which positions are recorded
    """

    step_s: float
    steps: int
    damping_ratio: float
    keys: KeyPoints
    volume_n_m: float = 0.0


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
    """Compute positions [m] and velocities [m/s] of the key points after each step, both (steps, p, 3).

    ``young`` (n,) [Pa]. Raises NotConverged if they do not stay finite, InputError unless all moduli are positive.
    """
    positions, velocities = trajectory(model, young, press, settings)
    return settings.keys.of(positions[1:]), settings.keys.of(velocities[1:])


def trajectory(
    model: SpringModel, young: np.ndarray, press: Press, settings: Settings
) -> tuple[np.ndarray, np.ndarray]:
    """Compute positions [m] and velocities [m/s] of all nodes, initially and after each step: (steps + 1, n, 3)."""
    if young.shape != model.masses.shape or not (young > 0.0).all():
        raise InputError(f"young of a spring network must be {len(model.masses)} positive numbers, one a node, in Pa.")
    stiffness = stiffnesses(model, young)
    x = np.empty((settings.steps + 1, *model.nodes.shape))
    v = np.empty_like(x)
    _record(x, v, stiffness, dampings(model, stiffness, settings.damping_ratio), *constants(model, press, settings))
    if not (np.isfinite(x).all() and np.isfinite(v).all()):
        raise NotConverged(
            f"press {press.name}: the motion diverges; take steps shorter than {settings.step_s:g} s", []
        )
    return x, v


def constants(model: SpringModel, press: Press, settings: Settings) -> tuple:
    """Collect the arguments of ``advance`` that no modulus changes, with the loads of all steps (steps, 3) [N]."""
    mobility = 1.0 / model.masses
    mobility[model.held] = 0.0
    volume_rest = rest_distance_sum(model.nodes, model.tetrahedra)
    loads = np.outer(press.factors(settings.step_s, settings.steps), press.force_n)
    network = (model.nodes, model.pairs, model.rest_m, model.tetrahedra, volume_rest, float(settings.volume_n_m))
    return *network, mobility, press.node, loads, settings.step_s


@numba.njit(cache=True, error_model="numpy")
def advance(x, v, force, stiffness, damping, pairs, rest, tetrahedra, volume_rest, volume, mobility, node, load, h):
    """Advance ``x`` and ``v`` (n, 3) by one step of symplectic Euler, in place; ``force`` (n, 3) is workspace."""
    force[:] = 0.0
    for e in range(len(pairs)):
        a, b = pairs[e, 0], pairs[e, 1]
        d0, d1, d2 = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
        length = np.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
        rate = (d0 * (v[b, 0] - v[a, 0]) + d1 * (v[b, 1] - v[a, 1]) + d2 * (v[b, 2] - v[a, 2])) / length
        tension = (stiffness[e] * (length - rest[e]) + damping[e] * rate) / length
        force[a, 0] += tension * d0
        force[a, 1] += tension * d1
        force[a, 2] += tension * d2
        force[b, 0] -= tension * d0
        force[b, 1] -= tension * d1
        force[b, 2] -= tension * d2
    if volume > 0.0:
        add_force(x, tetrahedra, volume_rest, volume, force)
    for i in range(3):
        force[node, i] += load[i]
    for a in range(len(x)):
        for i in range(3):
            v[a, i] += h * mobility[a] * force[a, i]
            x[a, i] += h * v[a, i]


@numba.njit(cache=True, error_model="numpy")
def _record(x, v, stiffness, damping, nodes, pairs, rest, tetrahedra, volume_rest, volume, mobility, node, loads, h):
    force = np.empty_like(nodes)
    x[0], v[0] = nodes, 0.0
    for s in range(len(loads)):
        x[s + 1], v[s + 1] = x[s], v[s]
        advance(
            x[s + 1], v[s + 1], force, stiffness, damping, pairs, rest, tetrahedra, volume_rest, volume, mobility, node,
            loads[s], h,
        )  # fmt: skip
