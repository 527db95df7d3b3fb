"""Motion of a pressed spring network, by explicit steps, and the reference that it is fitted to, by finite elements.

One choice of moduli moves, or several at a time. For the derivative (descent.py): step s = 0 … steps − 1 is, exactly
and in this order,

    k = ½ (E₁ + E₂) weight                                       (s,)  eq. 5
    μ = 2 ratio sqrt(k m₁m₂/(m₁ + m₂))                           (s,)  instead of eq. 6, see ``dampings``
    n = (x₂ − x₁)/l;  T = k (l − l₀) + μ n·(v₂ − v₁);  f₁ += T n;  f₂ −= T n        eq. 1, without rounding
    per tetrahedron, if volume_n_m > 0:  f_a −= κ (L − L₀)(u_a − ¼ Σu)             effects/volume_preservation.py
    f += press.factors(...)[s] · press.pattern(n)
    v ← v + h f(x, v)/m,  held nodes 0;  x ← x + h v             (the new v)

and the motion holds x and v after each step; key points are a fixed linear map of both.
"""

from dataclasses import dataclass

import numba
import numpy as np

from palpate.bodies.mesh import TetMesh
from palpate.bodies.particles import Particles
from palpate.effects import kelvin
from palpate.effects.held import Held
from palpate.effects.linear_elements import LinearElements
from palpate.effects.rayleigh import Rayleigh
from palpate.effects.springs import rest_lengths, sum_around_edges
from palpate.effects.volume_preservation import add_forces, rest_distance_sum
from palpate.errors import InputError, NotConverged
from palpate.solvers.backward_euler import BackwardEuler
from palpate.solvers.system import System

INSIDE_TOLERANCE = 1e-9
"""Tolerance of a negative barycentric coordinate, for points on the mesh's surface up to rounding."""


@dataclass(frozen=True, eq=False)
class SpringModel:
    """Point masses on the edges of tetrahedra, without the springs' stiffness (paper 2, eq. 1–5).

    nodes : (n, 3) [m]; tetrahedra : (m, 4); held : (k,) fixed nodes
    pairs : (s, 2) ends of the springs; rest_m : (s,) [m]; masses : (n,) [kg]
    weights : (s,) ΣV/l² [m], so that a spring between moduli E₁ and E₂ has k = ½ (E₁ + E₂) · weight (eq. 5); volumes of
        a stiffer region count as many times as it is stiffer than the body's own material
    """

    nodes: np.ndarray
    tetrahedra: np.ndarray
    pairs: np.ndarray
    rest_m: np.ndarray
    weights: np.ndarray
    masses: np.ndarray
    held: np.ndarray


def spring_model(particles: Particles) -> SpringModel:
    """Build the network of a solid's tetrahedra."""
    stiffer = particles.tissue.young_pa / particles.material.young_pa
    volumes = TetMesh(particles.nodes, particles.tetrahedra).volumes
    pairs, volume = sum_around_edges(particles.tetrahedra, stiffer * volumes)
    rest_m = rest_lengths(particles.nodes, pairs)
    held = np.array(particles.held)
    return SpringModel(particles.nodes, particles.tetrahedra, pairs, rest_m, volume / rest_m**2, particles.masses, held)


@dataclass(frozen=True, eq=False)
class KeyPoints:
    """p points that move with the mesh, each the sum of ``shares`` (p, 4) times the nodes ``corners`` (p, 4)."""

    corners: np.ndarray
    shares: np.ndarray

    def of(self, values: np.ndarray) -> np.ndarray:
        """Interpolate nodal ``values`` (…, n, 3) to (…, p, 3)."""
        return np.einsum("pc,...pci->...pi", self.shares, values[..., self.corners, :])


def key_points(nodes: np.ndarray, tetrahedra: np.ndarray, points_m: np.ndarray) -> KeyPoints:
    """Locate the ``points_m`` (p, 3) [m] that the config names in a mesh; raise InputError for one outside it."""
    origin = nodes[tetrahedra[:, 0]]
    edges = np.swapaxes(nodes[tetrahedra[:, 1:]] - origin[:, None], 1, 2)
    corners, shares = [], []
    for number, point in enumerate(np.asarray(points_m, dtype=float).reshape(-1, 3)):
        last_three = np.linalg.solve(edges, (point - origin)[:, :, None])[:, :, 0]
        barycentric = np.column_stack([1.0 - last_three.sum(axis=1), last_three])
        nearest = int(np.argmax(barycentric.min(axis=1)))
        if not barycentric[nearest].min() >= -INSIDE_TOLERANCE:  # a NaN is outside, too
            lowest, highest = nodes.min(axis=0), nodes.max(axis=0)
            raise InputError(
                f"springs.key_points_m[{number}] is {point.tolist()}, which is outside the mesh; "
                f"give a point in it, in metres, its nodes being from {lowest.tolist()} to {highest.tolist()}."
            )
        corners.append(tetrahedra[nearest])
        shares.append(barycentric[nearest])
    return KeyPoints(np.array(corners), np.array(shares))


@dataclass(frozen=True, eq=False)
class Press:
    """A load that rises over ``rise_s`` [s] as 3q² − 2q³ and is constant afterwards.

    force_n : (3,) [N] on the number ``node``, or (k, 3) on ``node`` (k,), each once
    """

    name: str
    node: int | np.ndarray
    force_n: np.ndarray
    rise_s: float

    def pattern(self, nodes: int) -> np.ndarray:
        """Return the force on each of so many nodes once it has risen, (nodes, 3) [N]."""
        load = np.zeros((nodes, 3))
        load[self.node] = self.force_n
        return load

    def factors(self, step_s: float, steps: int) -> np.ndarray:
        """Return the share of the force at the end of each explicit step, (steps,), from 0 to 1."""
        q = np.clip(step_s * np.arange(1, steps + 1) / self.rise_s, 0.0, 1.0)
        return q * q * (3.0 - 2.0 * q)


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
    """Return the arguments of ``advance`` that no modulus changes, with the factors of the load in all steps."""
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
        force_a, force_b = force[pairs[e, 0]], force[pairs[e, 1]]
        for i in range(3 * k):
            force_a[i] += work[i]
            force_b[i] -= work[i]
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
    """Write the positions ``x`` and velocities ``v`` after each step, (steps + 1, n, 3)."""
    force, work = np.empty_like(nodes), np.empty(12)
    x[0], v[0] = nodes, 0.0
    for s in range(len(factors)):
        x[s + 1], v[s + 1] = x[s], v[s]
        advance(
            x[s + 1], v[s + 1], force, work, stiffness, damping, pairs, rest, tetrahedra, volume_rest, volume, mobility,
            load, factors[s], h, ALONE,
        )  # fmt: skip


BALANCE_TOLERANCE = 1e-8
"""Relative tolerance of the force balance in each implicit step."""


def reference_motion(
    particles: Particles, model: SpringModel, press: Press, settings: Settings, substeps: int
) -> tuple[np.ndarray, np.ndarray]:
    """Compute positions [m] and velocities [m/s] of the key points by finite elements, (steps, p, 3) after each step.

    particles : those of ``model``, or of a finer level with a ``press`` of its own, whose first nodes are the same
    Damping is that of ``damping_time``. Each of the springs' steps is ``substeps`` steps of backward Euler, whose
    numerical damping, ω h/2 of critical for a mode of frequency ω, is not to be fitted. NotConverged where a step is
    not found.
    """
    elastic = LinearElements(particles, particles.tissue)
    time = damping_time(model, particles.material.young_pa, settings.damping_ratio)
    load = Load(press)
    effects = {"corotational": elastic, "held": Held(particles.held), "push": load}
    system = System(particles, effects | {"rayleigh": Rayleigh(particles.masses, 0.0, time, elastic)})
    integrator = BackwardEuler(system, BALANCE_TOLERANCE)
    x, v = particles.nodes, np.zeros_like(particles.nodes)
    positions, velocities = [], []
    for load.factor in press.factors(settings.step_s / substeps, settings.steps * substeps):  # sets the load's share
        x, v = integrator.step(x, v, settings.step_s / substeps)
        positions.append(x)
        velocities.append(v)
    recorded = slice(substeps - 1, None, substeps)
    return settings.keys.of(np.array(positions[recorded])), settings.keys.of(np.array(velocities[recorded]))


def damping_time(model: SpringModel, young_pa: float, ratio: float) -> float:
    """Compute β = Σ μ l²/Σ k l² [s] of the springs with one modulus, for damping β K with the FEM stiffness K.

    Then a body that swells at a constant rate loses as much power in C = β K as in the dampers.
    """
    stiffness = stiffnesses(model, np.full(len(model.masses), float(young_pa)))
    squares = model.rest_m**2
    return float((dampings(model, stiffness, ratio) * squares).sum() / (stiffness * squares).sum())


class Load:
    """A press as an effect, whose factor the loop sets."""

    outer = True

    def __init__(self, press: Press):
        self._press, self.factor = press, 0.0

    def add_force(self, x: np.ndarray, v: np.ndarray, force: np.ndarray) -> None:
        """Add the load to ``force`` (n, 3) [N]."""
        force[self._press.node] += self.factor * self._press.force_n
