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
    """Return the places (c, 3) [m] of contact points at unknowns ``z``; touch : of ``TouchingMotion._touch``."""
    rows, places, _, _, weights, nodes = touch
    r = rows.shape[1]
    points = (places.ravel() + np.dot(rows, z[:r])).reshape(-1, 3)
    for c in range(len(weights)):
        for a in range(weights.shape[1]):
            for i in range(3):
                points[c, i] += weights[c, a] * z[r + 3 * nodes[c, a] + i]
    return points


@numba.njit(cache=True, error_model="numpy")
def add_contact(whole, points, touch, rubbing, force):
    """Add the Hessian of contact to the lower triangle of ``whole`` (r + 3m, r + 3m), at points with a force."""
    rows, _, stiff, tools, weights, nodes = touch
    r = rows.shape[1]
    chosen = np.flatnonzero((force[:, 0] != 0.0) | (force[:, 1] != 0.0) | (force[:, 2] != 0.0))
    if not len(chosen):
        return
    blocks = stiffness(points, stiff, tools, rubbing, chosen)
    near_rows, stiff_rows = np.empty((3 * len(chosen), r)), np.empty((3 * len(chosen), r))
    for c in range(len(chosen)):
        near_rows[3 * c : 3 * c + 3] = rows[3 * chosen[c] : 3 * chosen[c] + 3]
        stiff_rows[3 * c : 3 * c + 3] = np.dot(blocks[c], near_rows[3 * c : 3 * c + 3])
    whole[:r, :r] += np.dot(near_rows.T, stiff_rows)  # between modes
    for c in range(len(chosen)):
        for a in range(weights.shape[1]):
            weight, row = weights[chosen[c], a], r + 3 * nodes[chosen[c], a]
            for i in range(3):  # between dents and modes
                for j in range(r):
                    whole[row + i, j] += weight * stiff_rows[3 * c + i, j]
            for b in range(weights.shape[1]):  # between dents
                column = r + 3 * nodes[chosen[c], b]
                for i in range(3):
                    for j in range(3):
                        whole[row + i, column + j] += weight * weights[chosen[c], b] * blocks[c, i, j]


@numba.njit(cache=True, error_model="numpy")
def pulled_by(force, touch, size):
    """Return the forces on all ``size`` unknowns, modes and then dents, of forces (c, 3) [N] on contact points."""
    rows, _, _, _, weights, nodes = touch
    r, pull = rows.shape[1], np.zeros(size)
    pull[:r] = np.dot(force.ravel(), rows)
    for c in range(len(weights)):
        for a in range(weights.shape[1]):
            for i in range(3):
                pull[r + 3 * nodes[c, a] + i] += weights[c, a] * force[c, i]
    return pull


@numba.njit(cache=True, error_model="numpy")
def improve(hessian, step, turn):
    """Update the ``hessian`` (r, r) in place by damped BFGS (Powell 1978; Nocedal and Wright 2006, 18.2).

    step : (r,); turn : (r,), the gradient's change over it, to which H step is added where curvature is too small
    """
    hessian_step = np.dot(hessian, step)
    old_curvature, new_curvature = np.dot(step, hessian_step), np.dot(step, turn)
    if new_curvature < 0.2 * old_curvature:
        mix = 0.8 * old_curvature / (old_curvature - new_curvature)
        turn = mix * turn + (1.0 - mix) * hessian_step
        new_curvature = np.dot(step, turn)
    if not new_curvature > 1e-300:
        return
    for i in range(len(step)):
        a, b = turn[i] / new_curvature, hessian_step[i] / old_curvature
        for j in range(len(step)):
            hessian[i, j] += a * turn[j] - b * hessian_step[j]


@numba.njit(cache=True, error_model="numpy")
def valued(z, energy, inertia, centre, share, outer, local, touch, rubbing, force):
    """Return the value [J] that ``minimise`` minimises at ``z`` = (q, w), q − centre, contact points, and local · w.

    energy : the elastic energy at z; ``force`` (c, 3) [N] on the points is written
    """
    r = len(inertia)
    from_centre = z[:r] - centre
    points = placed(z, touch)
    forces, energies = pushes(points, touch[2], touch[3], rubbing)
    force[:] = forces[0]
    for k in range(1, len(forces)):  # of all instruments
        force += forces[k]
    value = energies.sum() + 0.5 * np.sum(inertia * from_centre * from_centre) + share * energy - np.dot(outer, z)
    dent_forces = np.dot(local, z[r:]) if len(z) > r else z[r:].copy()
    return value + 0.5 * share * np.dot(dent_forces, z[r:]), from_centre, points, dent_forces


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
    floor, enough, most_steps = ends
    elastic_gradient, energy, residual, lower_factor = known
    least_steps = 0 if len(elastic_gradient) else 1  # what stages without any step leave would add up
    r, problem = len(inertia), (inertia, centre, share, outer, local, touch, rubbing, force)
    scratch = scratch_of(body)
    if not len(elastic_gradient):
        energy, elastic_gradient = elastic(z[:r].copy(), body, scratch)
    value, from_centre, points, dent_forces = valued(z, energy, *problem)
    residual, stored = np.inf, 0
    steps, turns, scale = np.empty((MEMORY, len(z))), np.empty((MEMORY, len(z))), np.empty(MEMORY)
    last_z, last_gradient = z.copy(), z.copy()
    for count in range(most_steps + 1):
        # the gradient and the step's direction; the Hessian is factored anew where the last step left too much
        gradient = -outer - pulled_by(force, touch, len(z))
        gradient[:r] += inertia * from_centre + share * elastic_gradient
        gradient[r:] += share * dent_forces
        if count:
            stored = remember(z - last_z, gradient - last_gradient, steps, turns, scale, stored)
        residual_before = residual
        for attempt in range(2):  # the second one with a new factor
            if attempt or not len(lower_factor) or stored == MEMORY:
                full_hessian = np.zeros((len(z), len(z)))
                full_hessian[:r, :r] = hessian
                full_hessian[r:, r:] = share * local
                add_contact(full_hessian, points, touch, rubbing, force)
                if not factor(full_hessian):
                    return elastic_gradient, energy, np.inf, lower_factor
                lower_factor, stored = full_hessian, 0
            direction = directed(lower_factor, -gradient, steps, turns, scale, stored)
            slope = np.dot(gradient, direction)
            residual = np.sqrt(max(0.0, -slope) / (share * max(energy, floor)))
            if stored == 0 or residual <= RESIDUAL_RATIO * residual_before:
                break
        if not slope < 0.0 or (residual <= enough and count >= least_steps) or count == most_steps:
            break
        # the length of the step, shortened by quadratic interpolation
        length, accepted = 1.0, False  # backtracking line search
        while length > 1e-5:
            trial = z + length * direction
            trial_energy, trial_gradient = elastic(trial[:r].copy(), body, scratch)
            trial_value, from_centre, points, dent_forces = valued(trial, trial_energy, *problem)
            if trial_value <= value + 1e-4 * length * slope + ROUNDING * abs(value):
                accepted = True
                break
            length *= min(0.5, max(0.1, -0.5 * slope * length / (trial_value - value - slope * length)))
        if not accepted:
            break
        step = trial[:r] - z[:r]
        improve(hessian, step, inertia * step + share * (trial_gradient - elastic_gradient))
        last_z[:], last_gradient[:] = z, gradient
        z[:], elastic_gradient, value, energy = trial, trial_gradient, trial_value, trial_energy
    return elastic_gradient, energy, residual, lower_factor
