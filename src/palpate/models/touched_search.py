"""Minimise the energy of a body in few coordinates that an instrument touches, by BFGS with contact's exact Hessian.

Unknowns z (r + 3m,) are the coordinates q (r,) of modes, and then dents w (m, 3) [m] of surface nodes, which modes
lack.
"""

import numba
import numpy as np

from palpate.collision.contact.instrument_contact import pushes, stiffness
from palpate.models.reduced.cholesky import factor
from palpate.models.reduced.cubature_points import elastic, scratch_of
from palpate.models.reduced.search import directed, remember

TOGETHER = 32
"""Cells of which forces are computed at once."""
ROUNDING = 1e-13
"""Of the function, relative."""
MEMORY, RESIDUAL_RATIO = 8, 0.7
"""Most steps that improve a factor, and what one of them has to leave, or the Hessian is factored anew."""


@numba.njit(cache=True, error_model="numpy")
def placed(z, touch):
    """Return the places (c, 3) [m] of contact points at unknowns ``z`` (r + 3m,)."""
    rows, places, _, _, weights, nodes = touch
    wide = rows.shape[1]
    points = (places.ravel() + np.dot(rows, z[:wide])).reshape(-1, 3)
    for c in range(len(weights)):
        for a in range(weights.shape[1]):
            for i in range(3):
                points[c, i] += weights[c, a] * z[wide + 3 * nodes[c, a] + i]
    return points


@numba.njit(cache=True, error_model="numpy")
def add_contact(whole, points, touch, rubbing, force):
    """Add the Hessian of contact to the lower triangle of ``whole`` (r + 3m, r + 3m), at points with a force."""
    rows, _, stiff, tools, weights, nodes = touch
    wide = rows.shape[1]
    chosen = np.flatnonzero((force[:, 0] != 0.0) | (force[:, 1] != 0.0) | (force[:, 2] != 0.0))
    if not len(chosen):
        return
    blocks = stiffness(points, stiff, tools, rubbing, chosen)
    near, bent = np.empty((3 * len(chosen), wide)), np.empty((3 * len(chosen), wide))
    for c in range(len(chosen)):
        near[3 * c : 3 * c + 3] = rows[3 * chosen[c] : 3 * chosen[c] + 3]
        bent[3 * c : 3 * c + 3] = np.dot(blocks[c], near[3 * c : 3 * c + 3])
    whole[:wide, :wide] += np.dot(near.T, bent)
    for c in range(len(chosen)):
        for a in range(weights.shape[1]):
            weight, at = weights[chosen[c], a], wide + 3 * nodes[chosen[c], a]
            for i in range(3):
                for j in range(wide):
                    whole[at + i, j] += weight * bent[3 * c + i, j]
            for b in range(weights.shape[1]):
                other = wide + 3 * nodes[chosen[c], b]
                for i in range(3):
                    for j in range(3):
                        whole[at + i, other + j] += weight * weights[chosen[c], b] * blocks[c, i, j]


@numba.njit(cache=True, error_model="numpy")
def pulled_by(force, touch, size):
    """Return the forces on the unknowns, (``size``,), of forces (c, 3) [N] on the contact points."""
    rows, _, _, _, weights, nodes = touch
    wide, pull = rows.shape[1], np.zeros(size)
    pull[:wide] = np.dot(force.ravel(), rows)
    for c in range(len(weights)):
        for a in range(weights.shape[1]):
            for i in range(3):
                pull[wide + 3 * nodes[c, a] + i] += weights[c, a] * force[c, i]
    return pull


@numba.njit(cache=True, error_model="numpy")
def improve(hessian, step, turn):
    """Update the ``hessian`` (r, r) in place by damped BFGS (Powell 1978; Nocedal and Wright 2006, 18.2).

    step : (r,); turn : (r,), the change of the gradient along it
    """
    bent = np.dot(hessian, step)
    along, across = np.dot(step, bent), np.dot(step, turn)
    if across < 0.2 * along:
        mix = 0.8 * along / (along - across)
        turn = mix * turn + (1.0 - mix) * bent
        across = np.dot(step, turn)
    if not across > 1e-300:
        return
    for i in range(len(step)):
        a, b = turn[i] / across, bent[i] / along
        for j in range(len(step)):
            hessian[i, j] += a * turn[j] - b * bent[j]


@numba.njit(cache=True, error_model="numpy")
def valued(z, energy, inertia, centre, share, outer, local, touch, rubbing, force):
    """Return the value that ``minimise`` minimises at ``z``, q − centre, the places of points, and local · w.

    energy : the elastic energy at z; ``force`` (c, 3) [N] on the points is written
    """
    wide = len(inertia)
    away = z[:wide] - centre
    points = placed(z, touch)
    forces, energies = pushes(points, touch[2], touch[3], rubbing)
    force[:] = forces[0]
    for k in range(1, len(forces)):
        force += forces[k]
    value = energies.sum() + 0.5 * np.sum(inertia * away * away) + share * energy - np.dot(outer, z)
    bent = np.dot(local, z[wide:]) if len(z) > wide else z[wide:].copy()
    return value + 0.5 * share * np.dot(bent, z[wide:]), away, points, bent


@numba.njit(cache=True, error_model="numpy")
def minimise(z, inertia, centre, share, outer, local, hessian, body, touch, rubbing, force, ends, known):
    """Minimise ½ Σ inertia (q − centre)² + share (E(q) + ½ w · local w) − outer · z + contact, from z on, in place.

    z : (r + 3m,), coordinates q and dents w; local : (3m, 3m) [N/m], the stiffness of dents
    hessian : (r, r) without contact, which the caller keeps and elastic gradients improve; contact's Hessian is added
        exactly
    body, touch : arguments of ``elastic`` and ``placed``; force : (c, 3) [N], is written
    ends : ``floor`` [J], ``enough`` and the most steps; it ends where a step would gain less than ``enough``² of the
        elastic energy, of ``floor`` at least
    known : what a search that ended at z returned, so that it is not computed again: elastic gradient (r,) and energy,
        residual, and factor (r + 3m, r + 3m) of the Hessian; a gradient and a factor without size where there was none
    Returns the same of the minimum; the residual is ∞ where the Hessian is not positive definite or not finite. The
    Hessian is factored where the search begins without a factor, and again where steps leave too much.
    """
    floor, enough, most = ends
    own, energy, left, lower = known
    fewest = 0 if len(own) else 1  # steps; stages in which nothing is done would add up
    wide, problem = len(inertia), (inertia, centre, share, outer, local, touch, rubbing, force)
    scratch = scratch_of(body)
    if not len(own):
        energy, own = elastic(z[:wide].copy(), body, scratch)
    value, away, points, bent = valued(z, energy, *problem)
    left, kept = np.inf, 0
    steps, turns, scale = np.empty((MEMORY, len(z))), np.empty((MEMORY, len(z))), np.empty(MEMORY)
    begun, old = z.copy(), z.copy()
    for rounds in range(most + 1):
        # the gradient, and the direction of a factor, which is made anew where the last step has left too much
        gradient = -outer - pulled_by(force, touch, len(z))
        gradient[:wide] += inertia * away + share * own
        gradient[wide:] += share * bent
        if rounds:
            kept = remember(z - begun, gradient - old, steps, turns, scale, kept)
        before = left
        for factored in range(2):
            if factored or not len(lower) or kept == MEMORY:
                whole = np.zeros((len(z), len(z)))
                whole[:wide, :wide] = hessian
                whole[wide:, wide:] = share * local
                add_contact(whole, points, touch, rubbing, force)
                if not factor(whole):
                    return own, energy, np.inf, lower
                lower, kept = whole, 0
            ahead = directed(lower, -gradient, steps, turns, scale, kept)
            slope = np.dot(gradient, ahead)
            left = np.sqrt(max(0.0, -slope) / (share * max(energy, floor)))
            if kept == 0 or left <= RESIDUAL_RATIO * before:
                break
        if not slope < 0.0 or (left <= enough and rounds >= fewest) or rounds == most:
            break
        # the length of the step, shortened by quadratic interpolation
        length, accepted = 1.0, False
        while length > 1e-5:
            reached = z + length * ahead
            less, pulled = elastic(reached[:wide].copy(), body, scratch)
            there, away, points, bent = valued(reached, less, *problem)
            if there <= value + 1e-4 * length * slope + ROUNDING * abs(value):
                accepted = True
                break
            length *= min(0.5, max(0.1, -0.5 * slope * length / (there - value - slope * length)))
        if not accepted:
            break
        step = reached[:wide] - z[:wide]
        improve(hessian, step, inertia * step + share * (pulled - own))
        begun[:], old[:] = z, gradient
        z[:], own, value, energy = reached, pulled, there, less
    return own, energy, left, lower
