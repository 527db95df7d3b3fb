"""Viscous stress of tissue: a Prony series on the part of finite elements' stress that changes their shape.

The strain is e = k dev Q with Q = √(FᵀF + w² I), w = WIDTH and k = √(1 + w²). For w = 0 Q is the stretch tensor of the
corotational law, in the frame of the material. The stretch has no derivative where an element is flat; Q has all of
them everywhere, and k makes the slope at rest that of the stretch.

Q follows from its invariants without a principal frame: i₁ is the largest root of (i² − I)² = 4 (II + 2 i₃ i), where I,
II, i₃² are the invariants of Q², and always simple; then Q = (Q² + i₂)⁻¹ (i₁ Q² + i₃) (Hoger and Carlson 1984). As
Q δQ + δQ Q = δ(FᵀF), a stress Σ with respect to Q is P = 2 F Λ with respect to F, where Q Λ + Λ Q = Σ. The second
variation of Σ : Q is 2 Λ : (δFᵀδF − δQ²).

A block is an array (9, BLOCK) of F, row by row, or (6, BLOCK) of symmetric matrices: xx, yy, zz, yz, zx, xy; each
column is one element.
"""

import math

import numba
import numpy as np

from palpate.bodies.material import Series, prony_fault
from palpate.bodies.particles import Particles
from palpate.effects import settings
from palpate.effects.corotational import ARITHMETIC, BLOCK
from palpate.effects.effect import Energy, Relaxation, StepBegin, StepEnd, Stiffness
from palpate.effects.elements import OnePass
from palpate.effects.linear_elements import LinearElements, write_gradient
from palpate.effects.principal import add_blocks
from palpate.errors import InputError

WIDTH = 0.05
"""w: principal stretches below it count as little more than zero."""
SLOPE = math.sqrt(1.0 + WIDTH**2)
"""k."""
_FEWEST, _MOST = 6, 60
_ROUNDING = 1e-15


@numba.njit(cache=True, error_model="numpy")
def strains(x, tetrahedra, gradients):
    """Return the strain e = k dev Q of each of m elements at ``x`` (n, 3) [m], (m, 6)."""
    strain = np.empty((len(tetrahedra), 6))
    f, q, scratch = np.empty((9, BLOCK)), np.empty((6, BLOCK)), np.empty((4, BLOCK))
    for begin in range(0, len(tetrahedra), BLOCK):
        count = min(BLOCK, len(tetrahedra) - begin)
        stretches(x, tetrahedra, gradients, begin, count, f, q, scratch)
        for k in range(count):
            mean = (q[0, k] + q[1, k] + q[2, k]) / 3.0
            for c in range(6):
                strain[begin + k, c] = SLOPE * (q[c, k] - mean if c < 3 else q[c, k])
    return strain


@numba.njit(cache=True, error_model="numpy")
def energy_and_force(x, tetrahedra, gradients, stiffness, centers, force):
    """Add the nodal forces [N] to ``force`` (n, 3), and return the energy Σ stiffness ‖e − center‖² [J].

    gradients : (m, 4, 3) [1/m]; stiffness : (m,) modulus times volume [J]; centers : (m, 6) strains without force
    Elements go in blocks, in which f holds deformation gradients and then, in their place, first Piola stresses.
    """
    f, q, scratch = np.empty((9, BLOCK)), np.empty((6, BLOCK)), np.empty((4, BLOCK))
    center, inner = np.empty((6, BLOCK)), np.empty((6, BLOCK))
    stiff, energies, total = np.empty(BLOCK), np.empty(BLOCK), 0.0
    for begin in range(0, len(tetrahedra), BLOCK):
        count = min(BLOCK, len(tetrahedra) - begin)
        for k in range(count):
            stiff[k] = stiffness[begin + k]
            for c in range(6):
                center[c, k] = centers[begin + k, c]
        stretches(x, tetrahedra, gradients, begin, count, f, q, scratch)
        inner_stresses(q, center, stiff, count, energies, inner)
        _stresses(f, inner, count)
        for k in range(count):
            e = begin + k
            total += energies[k]
            for i in range(3):
                p0, p1, p2 = f[3 * i, k], f[3 * i + 1, k], f[3 * i + 2, k]
                for a in range(4):
                    pull = p0 * gradients[e, a, 0] + p1 * gradients[e, a, 1] + p2 * gradients[e, a, 2]
                    force[tetrahedra[e, a], i] -= pull
    return total


@numba.njit(cache=True, error_model="numpy")
def stretches(x, tetrahedra, gradients, begin, count, f, q, scratch):
    """Write F and Q of ``count`` elements from ``begin`` on, and i₁, i₂ and i₃ into rows 0, 2 and 3 of ``scratch``."""
    for k in range(count):
        write_gradient(x, tetrahedra, gradients, begin + k, f, k)
    _squares(f, q, scratch, count)
    for n in range(_MOST):
        if _improve(scratch, count) == count and n >= _FEWEST:
            break
    _roots(q, scratch, count)


@numba.njit(cache=True, error_model="numpy", fastmath=ARITHMETIC)
def _squares(f, q, scratch, count):
    """Write Q² = FᵀF + w² I of each column into ``q``; an upper bound of i₁, and I, II and i₃, into ``scratch``."""
    for k in range(count):
        a = f[0, k] * f[0, k] + f[3, k] * f[3, k] + f[6, k] * f[6, k] + WIDTH**2
        b = f[1, k] * f[1, k] + f[4, k] * f[4, k] + f[7, k] * f[7, k] + WIDTH**2
        c = f[2, k] * f[2, k] + f[5, k] * f[5, k] + f[8, k] * f[8, k] + WIDTH**2
        d = f[1, k] * f[2, k] + f[4, k] * f[5, k] + f[7, k] * f[8, k]
        e = f[2, k] * f[0, k] + f[5, k] * f[3, k] + f[8, k] * f[6, k]
        g = f[0, k] * f[1, k] + f[3, k] * f[4, k] + f[6, k] * f[7, k]
        bc, ca, ab = b * c - d * d, c * a - e * e, a * b - g * g
        third = a * bc + g * (d * e - g * c) + e * (g * d - b * e)
        q[0, k], q[1, k], q[2, k], q[3, k], q[4, k], q[5, k] = a, b, c, d, e, g
        scratch[0, k], scratch[1, k] = math.sqrt(3.0 * (a + b + c)), a + b + c
        scratch[2, k], scratch[3, k] = bc + ca + ab, math.sqrt(max(third, 0.0))


@numba.njit(cache=True, error_model="numpy", fastmath=ARITHMETIC)
def _improve(scratch, count):
    """Take a step of Newton's method for i₁, from above, in each column; return in how many it was negligible."""
    settled = 0
    for k in range(count):
        i1, beyond = scratch[0, k], scratch[0, k] * scratch[0, k] - scratch[1, k]
        excess = 0.25 * beyond * beyond - scratch[2, k] - 2.0 * scratch[3, k] * i1
        step = excess / (i1 * beyond - 2.0 * scratch[3, k])
        scratch[0, k] = i1 - step
        settled += 1 if not step > _ROUNDING * i1 else 0
    return settled


@numba.njit(cache=True, error_model="numpy", fastmath=ARITHMETIC)
def _roots(q, scratch, count):
    """Replace the squares in ``q`` by Q = (Q² + i₂)⁻¹ (i₁ Q² + i₃), and II in ``scratch`` by i₂."""
    for k in range(count):
        i1, i3 = scratch[0, k], scratch[3, k]
        i2 = 0.5 * (i1 * i1 - scratch[1, k])
        scratch[2, k] = i2
        a, b, c, d, e, g = q[0, k] + i2, q[1, k] + i2, q[2, k] + i2, q[3, k], q[4, k], q[5, k]
        bc, ca, ab = b * c - d * d, c * a - e * e, a * b - g * g
        ad, be, cg = e * g - a * d, g * d - b * e, d * e - c * g
        # i₁ Q² + i₃ is i₁ (Q² + i₂) + (i₃ − i₁ i₂)
        scale = (i3 - i1 * i2) / (a * bc + g * cg + e * be)
        q[0, k], q[1, k], q[2, k] = i1 + scale * bc, i1 + scale * ca, i1 + scale * ab
        q[3, k], q[4, k], q[5, k] = scale * ad, scale * be, scale * cg


@numba.njit(cache=True, error_model="numpy", fastmath=ARITHMETIC)
def inner_stresses(q, center, stiff, count, energies, inner):
    """Write 2 Λ times the volume [J] of each column into ``inner`` (6, BLOCK), and the ``energies`` (BLOCK,) [J]."""
    for k in range(count):
        a, b, c, d, e, g = q[0, k], q[1, k], q[2, k], q[3, k], q[4, k], q[5, k]
        mean = (a + b + c) / 3.0
        sa, sb = SLOPE * (a - mean) - center[0, k], SLOPE * (b - mean) - center[1, k]
        sc, sd = SLOPE * (c - mean) - center[2, k], SLOPE * d - center[3, k]
        se, sg = SLOPE * e - center[4, k], SLOPE * g - center[5, k]
        energies[k] = stiff[k] * (sa * sa + sb * sb + sc * sc + 2.0 * (sd * sd + se * se + sg * sg))
        scale = 4.0 * SLOPE * stiff[k]
        sa, sb, sc, sd, se, sg = scale * sa, scale * sb, scale * sc, scale * sd, scale * se, scale * sg
        inner[0, k], inner[1, k], inner[2, k], inner[3, k], inner[4, k], inner[5, k] = half_root(
            a, b, c, d, e, g, sa, sb, sc, sd, se, sg
        )


@numba.njit(cache=True, error_model="numpy", fastmath=ARITHMETIC)
def half_root(a, b, c, d, e, g, sa, sb, sc, sd, se, sg):
    """Return the symmetric X of Q X + X Q = S, from the entries of Q and of S.

    X = Q⁻¹ (S + N) / 2, where N = [n]× makes it symmetric: (i₁ − Q) n is the axis of Q S − S Q.
    """
    # entries zy, xz and yx of Q S − S Q
    t0 = e * sg + d * sb + c * sd - (se * g + sd * b + sc * d)
    t1 = a * se + g * sd + e * sc - (sa * e + sg * d + se * c)
    t2 = g * sa + b * sg + d * se - (sg * a + sb * g + sd * e)
    ta, tb, tc = b + c, c + a, a + b
    bc, ca, ab = tb * tc - d * d, tc * ta - e * e, ta * tb - g * g
    ad, be, cg = e * g + ta * d, g * d + tb * e, d * e + tc * g
    scale = 1.0 / (ta * bc - g * cg - e * be)
    n0 = scale * (bc * t0 + cg * t1 + be * t2)
    n1 = scale * (cg * t0 + ca * t1 + ad * t2)
    n2 = scale * (be * t0 + ad * t1 + ab * t2)
    bc, ca, ab = b * c - d * d, c * a - e * e, a * b - g * g
    ad, be, cg = e * g - a * d, g * d - b * e, d * e - c * g
    scale = 0.5 / (a * bc + g * cg + e * be)
    return (
        scale * (bc * sa + cg * (sg + n2) + be * (se - n1)),
        scale * (cg * (sg - n2) + ca * sb + ad * (sd + n0)),
        scale * (be * (se + n1) + ad * (sd - n0) + ab * sc),
        scale * (cg * (se + n1) + ca * (sd - n0) + ad * sc),
        scale * (be * sa + ad * (sg + n2) + ab * (se - n1)),
        scale * (bc * (sg - n2) + cg * sb + be * (sd + n0)),
    )


@numba.njit(cache=True, error_model="numpy", fastmath=ARITHMETIC)
def _stresses(f, inner, count):
    """Replace F by the stress with respect to it, 2 F Λ, times the volume [J]; inner : 2 Λ times the volume."""
    for i in range(3):
        for k in range(count):
            f0, f1, f2 = f[3 * i, k], f[3 * i + 1, k], f[3 * i + 2, k]
            f[3 * i, k] = f0 * inner[0, k] + f1 * inner[5, k] + f2 * inner[4, k]
            f[3 * i + 1, k] = f0 * inner[5, k] + f1 * inner[1, k] + f2 * inner[3, k]
            f[3 * i + 2, k] = f0 * inner[4, k] + f1 * inner[3, k] + f2 * inner[2, k]


_PART = 64
"""Elements in one block, whose 12 variations are kept."""


@numba.njit(cache=True, error_model="numpy")
def add_stiffness(x, tetrahedra, gradients, stiffness, centers, definite, slots, values):
    """Add the Hessian's blocks [N/m] to ``values`` (n_blocks, 3, 3), those of element e at ``slots[e]`` (4, 4).

    ``definite`` leaves out second derivatives of the strain; moved : δQ for each motion of a corner along an axis.
    """
    f, q, scratch = np.empty((9, _PART)), np.empty((6, _PART)), np.empty((4, _PART))
    center, inner, g = np.empty((6, _PART)), np.zeros((6, _PART)), np.empty((12, _PART))
    stiff, energies = np.empty(_PART), np.empty(_PART)
    moved, dual, block = np.empty((72, _PART)), np.empty((72, _PART)), np.empty((9, _PART))
    for begin in range(0, len(tetrahedra), _PART):
        count = min(_PART, len(tetrahedra) - begin)
        for k in range(count):
            stiff[k] = stiffness[begin + k]
            for c in range(6):
                center[c, k] = centers[begin + k, c]
            for c in range(12):
                g[c, k] = gradients[begin + k, c // 3, c % 3]
        stretches(x, tetrahedra, gradients, begin, count, f, q, scratch)
        if not definite:
            inner_stresses(q, center, stiff, count, energies, inner)
        for p in range(12):
            _variation(f, q, g, p, count, moved)
            _dual(moved, stiff, inner, p, count, dual)
        for a in range(4):
            for b in range(a, 4):
                _block(moved, dual, inner, g, a, b, count, block)
                add_blocks(block, slots, begin, count, a, b, values)


@numba.njit(cache=True, error_model="numpy", fastmath=ARITHMETIC)
def _variation(f, q, g, p, count, moved):
    """Write δQ for the motion ``p`` = 3 a + i, of node a along axis i, into rows 6 p to 6 p + 5 of ``moved``."""
    a, i = p // 3, p % 3
    for k in range(count):
        g0, g1, g2 = g[3 * a, k], g[3 * a + 1, k], g[3 * a + 2, k]
        f0, f1, f2 = f[3 * i, k], f[3 * i + 1, k], f[3 * i + 2, k]
        xx, yy, zz = 2.0 * f0 * g0, 2.0 * f1 * g1, 2.0 * f2 * g2
        yz, zx, xy = f1 * g2 + f2 * g1, f2 * g0 + f0 * g2, f0 * g1 + f1 * g0
        root = half_root(q[0, k], q[1, k], q[2, k], q[3, k], q[4, k], q[5, k], xx, yy, zz, yz, zx, xy)
        moved[6 * p, k], moved[6 * p + 1, k], moved[6 * p + 2, k] = root[0], root[1], root[2]
        moved[6 * p + 3, k], moved[6 * p + 4, k], moved[6 * p + 5, k] = root[3], root[4], root[5]


@numba.njit(cache=True, error_model="numpy", fastmath=ARITHMETIC)
def _dual(moved, stiff, inner, p, count, dual):
    """Write 2 k² ``stiff`` dev δQ − (Λ δQ + δQ Λ), 2 Λ being ``inner``, of motion ``p``, off-diagonals doubled."""
    for k in range(count):
        a, b, c = moved[6 * p, k], moved[6 * p + 1, k], moved[6 * p + 2, k]
        d, e, g = moved[6 * p + 3, k], moved[6 * p + 4, k], moved[6 * p + 5, k]
        la, lb, lc, ld, le, lg = inner[0, k], inner[1, k], inner[2, k], inner[3, k], inner[4, k], inner[5, k]
        scale, mean = 2.0 * SLOPE * SLOPE * stiff[k], (a + b + c) / 3.0
        dual[6 * p, k] = scale * (a - mean) - (la * a + lg * g + le * e)
        dual[6 * p + 1, k] = scale * (b - mean) - (lg * g + lb * b + ld * d)
        dual[6 * p + 2, k] = scale * (c - mean) - (le * e + ld * d + lc * c)
        dual[6 * p + 3, k] = 2.0 * scale * d - (lg * e + lb * d + ld * c + g * le + b * ld + d * lc)
        dual[6 * p + 4, k] = 2.0 * scale * e - (la * e + lg * d + le * c + a * le + g * ld + e * lc)
        dual[6 * p + 5, k] = 2.0 * scale * g - (la * g + lg * b + le * d + a * lg + g * lb + e * ld)


@numba.njit(cache=True, error_model="numpy", fastmath=ARITHMETIC)
def _block(moved, dual, inner, g, a, b, count, block):
    """Write the Hessian of nodes ``a`` and ``b``, δQ : ``dual`` and 2 Λ : δFᵀδF, into ``block`` (9, _PART) [N/m]."""
    for i in range(3):
        for j in range(3):
            p, q = 6 * (3 * a + i), 6 * (3 * b + j)
            for k in range(count):
                t = moved[p, k] * dual[q, k] + moved[p + 1, k] * dual[q + 1, k] + moved[p + 2, k] * dual[q + 2, k]
                t += moved[p + 3, k] * dual[q + 3, k] + moved[p + 4, k] * dual[q + 4, k]
                block[3 * i + j, k] = t + moved[p + 5, k] * dual[q + 5, k]
    for k in range(count):
        g0, g1, g2 = g[3 * a, k], g[3 * a + 1, k], g[3 * a + 2, k]
        h0, h1, h2 = g[3 * b, k], g[3 * b + 1, k], g[3 * b + 2, k]
        same = g0 * (inner[0, k] * h0 + inner[5, k] * h1 + inner[4, k] * h2)
        same += g1 * (inner[5, k] * h0 + inner[1, k] * h1 + inner[3, k] * h2)
        same += g2 * (inner[4, k] * h0 + inner[3, k] * h1 + inner[2, k] * h2)
        block[0, k] += same
        block[4, k] += same
        block[8, k] += same


TWICE = np.array([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])
"""How often each of the six entries of a strain occurs in its symmetric matrix."""


def make(particles: Particles, prony: settings.Prony, elastic: LinearElements) -> "Prony":
    """Make the branches of a series beside finite elements; InputError for a series that is not valid."""
    if flaw := prony_fault(prony):
        raise InputError(f"{particles.name}: prony.{flaw}.")
    return Prony(elastic, Series(prony.shares, prony.times_s))


class Prony(OnePass, Energy, Stiffness, StepBegin, StepEnd, Relaxation):
    """Springs in series with dampers, beside the elastic law: Ψ = Σ μᵢ ‖e − qᵢ‖², dqᵢ/dt = (e − qᵢ)/τᵢ.

    e is the deviatoric stretch in the frame of the material, so a rotation changes nothing; qᵢ, in
    ``inner`` (m, k, 6), are the lengths of the dampers, and μᵢ is that of the elastic law at rest times the ratio of
    the branch. Under a corotational law the first response is that of a shear modulus larger by 1/(1 − Σ gᵢ), at any
    strain; the last one is that without the effect.

    **A step.** The strain changes evenly over it, for which the update of q is exact (Series.factors); so creep and
    relaxation are of second order in the step. The force at its end is the gradient of the energy
    Σ μᵢ bᵢ ‖e − rᵢ‖² with rᵢ = (1 − aᵢ/bᵢ) eₙ + aᵢ/bᵢ qᵢ, which ``begin`` prepares for backward Euler; ``end`` and
    ``relax`` leave the energy that is stored.

    **Energy.** With sᵢ = eₙ − qᵢ the former is μ a²/b s² ≤ μ s² at the start of the step, and μ/b s² ≥ μ s² at its end:
    each branch takes energy out of every step of every length. Explicit steps take the force at their start.

    Traps: an element that is turned inside out is, for a branch, in the same state as its mirror image; only the
    elastic law sets it right. The longest stable explicit step is that of the instantaneous modulus.
    """

    def __init__(self, elastic: LinearElements, series: Series):
        super().__init__()
        self.couples, self.series = elastic.couples, series
        self._gradients = elastic.gradients.copy()  # plasticity changes those of the elastic effect, and not these
        shear_pa, _ = elastic.moduli
        self._moduli = shear_pa * elastic.volumes  # [J]
        self.inner = np.zeros((len(self.couples), len(series.shares), 6))
        self._strain: np.ndarray | None = None  # at the end of the last step
        # of the implicit step under way [s], and whether ``end`` has updated the branches, so that ``relax`` must not
        self._step, self._ended = 0.0, False
        self._prepare(0.0)

    def evaluate(self, x: np.ndarray, force: np.ndarray) -> float:
        moved = energy_and_force(x, self.couples, self._gradients, self._stiffness, self._centers, force)
        return moved + self._apart

    def add_stiffness(self, x: np.ndarray, definite: bool, slots: np.ndarray, values: np.ndarray) -> None:
        """Add the Hessian's blocks to ``values`` (n_blocks, 3, 3) [N/m], those of element e at ``slots[e]`` (4, 4).

        ``definite`` leaves out the second derivatives of the strain, which vanish with the stress.
        """
        add_stiffness(x, self.couples, self._gradients, self._stiffness, self._centers, definite, slots, values)

    def begin(self, x: np.ndarray, h: float) -> np.ndarray:
        """Prepare the energy of a step of ``h`` [s] from the last positions, the first time from ``x`` (n, 3) [m]."""
        if self._strain is None:
            self._strain = self._strains(x)
        self._step = h
        self._prepare(h)
        return x

    def end(self, x: np.ndarray) -> None:
        """Update the branches by the step that has begun and ends at ``x`` (n, 3) [m]."""
        self._advance(x, self._step)
        self._ended = True

    def relax(self, x: np.ndarray, h: float) -> None:
        """Update the branches by an explicit step of ``h`` [s] that ends at ``x`` (n, 3) [m]."""
        if not self._ended:
            self._advance(x, h)
        self._ended = False

    def _advance(self, x: np.ndarray, h: float) -> None:
        if self._strain is None:  # the first explicit step begins where the force was asked for
            self._strain = self._strains(self._kept[0][0] if self._kept else x)
        before, self._strain = self._strain[:, None], self._strains(x)
        a, b = (factor[:, None] for factor in self.series.factors(h))
        self.inner = a * self.inner + (b - a) * before + (1.0 - b) * self._strain[:, None]
        self._prepare(0.0)

    def _prepare(self, h: float) -> None:
        """Set the energy of a step of ``h`` [s], all branches as one square: moduli, centers and a constant [J]."""
        self.forget()
        a, b = self.series.factors(h)
        weights = self.series.ratios * b
        share, total = (a / b)[:, None], weights.sum()
        centers = self.inner
        if self._strain is not None and h > 0.0:
            centers = share * self.inner + (1.0 - share) * self._strain[:, None]
        self._centers = np.einsum("k,mkc->mc", weights / total, centers)
        self._stiffness = total * self._moduli
        squares = (centers - self._centers[:, None]) ** 2 @ TWICE
        self._apart = float(self._moduli @ (squares @ weights))

    def _strains(self, x: np.ndarray) -> np.ndarray:
        return strains(x, self.couples, self._gradients)
