"""Reduce a held body to modes of motion that are the limit of quadratic elements, and to few cubature points.

Every mode is a linear response to a fixed load: pushes, weight, the inertia of vibrations, and second derivatives of
the elastic force along such responses. The same load on two levels of elements shows how responses change, and by the
ratio by which each level divides the error, their limit.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy import sparse

from palpate.bodies.body import Body
from palpate.bodies.refinement import quadratic_prolongation, with_midpoints
from palpate.effects.patch_load import Patch, spread
from palpate.effects.settings import Loads, Rayleigh
from palpate.errors import InputError
from palpate.linalg.multigrid import Factor
from palpate.models.contact_modes.elements_at_rest import ElementsAtRest
from palpate.models.reduced.basis import bending_loads, independent, products, vibrations
from palpate.models.reduced.energy import ReducedEnergy
from palpate.solvers.quadratic_motion import QuadraticMotion

UNDAMPED = Rayleigh(mass_1_s=0.0, stiffness_s=0.0)
LEAST_RATIO = 1.5
"""Smallest ratio that is extrapolated by; below, levels hardly approach a limit."""
SMALL = 1e-6
"""Peak, in sizes of the body, of an answer that is linear."""
CHANGE_RESIDUAL = 1e-2
"""Relative residual of what a level changes of an answer, which ratios of convergence are made of."""
RESIDUAL, BEND_RESIDUAL = 1e-6, 1e-3
"""Relative residuals of linear answers, and of those to what bends them."""


def check_same(own: Body, body: Body) -> None:
    """Raise InputError unless ``body`` has the mesh, material and anchors of ``own``, for which modes were computed."""
    alike = own.material == body.material and len(own.levels) == len(body.levels)
    alike = alike and np.array_equal(own.fine.nodes, body.fine.nodes)
    if not (alike and np.array_equal(own.anchors[-1], body.anchors[-1])):
        raise InputError(f"its modes are those of another body than {body.name}; prepare them for this one.")


class BodyAtRest:
    """Quadratic elements on two levels of a body at rest and its slowest vibrations: the source of all modes.

    coarse, elements : of the first level of the finest one's shape, and of the next one
    up : (n, n_coarse) interpolation from the nodes of one to those of the other
    motion : the motion of ``elements`` without loads; mesh : their corners
    inertia : (n, 3, count) [N], loads of the vibrations; period_s : of the slowest
    gain : 1/(r − 1), where a level divides the error of the response to inertia by r: the change from one level to the
        other is multiplied by it to reach the limit
    Raises InputError for a body that nothing holds, and NotConverged as ``ElementsAtRest``.
    """

    def __init__(self, body: Body, count: int):
        level = body.shape_level  # before it the elements are another shape's, and answers are not nested
        whole = with_midpoints(replace(body, smooth=None), level + 2)
        self.body, self.surface = body, _to_surface(body, whole, level + 1)
        self.coarse, self.elements = (ElementsAtRest(whole, level + finer) for finer in (0, 1))
        self.up, up_to_finest = (quadratic_prolongation(*whole.levels[k : k + 2]) for k in (level, level + 1))
        self.mesh = whole.levels[level + 1]
        coarse, self.motion, finest = (QuadraticMotion(whole, level + finer, Loads(), UNDAMPED) for finer in (0, 1, 2))
        # the vibrations of linear elements on the same nodes, as their loads alone are wanted
        solve, free = Factor(coarse.linear_stiffness(coarse.rest)).solve, ~coarse.held
        shapes, frequencies = vibrations(lambda f: solve(f * free[:, None]), coarse.lumped, free, max(count, 1))
        self.period_s = 2.0 * np.pi / frequencies[0]
        swings = self.up @ shapes.transpose(1, 2, 0).reshape(len(free), -1)
        self.inertia = (self.motion.masses @ swings).reshape(-1, 3, len(shapes))[:, :, :count]
        slowest = (up_to_finest @ swings.reshape(-1, 3, len(shapes))[:, :, 0]).reshape(-1, 3)
        self.gain = self._gain(finest, up_to_finest, finest.masses @ slowest)

    def _gain(self, finest: QuadraticMotion, up_to_finest: sparse.sparray, load: np.ndarray) -> float:
        """Return 1/(r − 1), r being the ratio of the changes of the response to ``load`` (n_finest, 3) [N] by level."""
        load = np.where(finest.held[:, None], 0.0, load)
        response, coarse_change = self.answers((up_to_finest.T @ load)[:, :, None])
        scale = SMALL * self.elements.size / np.abs(response).max()  # so that the answer is linear
        unbalanced = scale * load + finest.force(finest.rest + scale * (up_to_finest @ response[:, :, 0]))
        finest_change = finest.static_response(finest.rest, unbalanced, CHANGE_RESIDUAL) / scale
        ratio = np.linalg.norm(up_to_finest @ coarse_change[:, :, 0]) / np.linalg.norm(finest_change)
        return 1.0 / (max(float(ratio), LEAST_RATIO) - 1.0)

    def check(self, body: Body) -> None:
        """Raise InputError unless ``body`` is the one that modes were computed for."""
        check_same(self.body, body)

    def answers(self, loads: np.ndarray, residual: float = RESIDUAL) -> tuple[np.ndarray, np.ndarray]:
        """Return linear responses (n, 3, k) [m] to ``loads`` (n, 3, k) [N], and their changes from the coarse level."""
        flat = self.up.T @ loads.reshape(len(loads), -1)
        responses = self.elements.solve(loads, residual)
        coarse = self.coarse.solve(flat.reshape(-1, 3, loads.shape[2]), residual)
        return responses, responses - (self.up @ coarse.reshape(len(coarse), -1)).reshape(responses.shape)

    def spread(self, patch: Patch) -> np.ndarray:
        """Return the loads (n, 3, 3) [N] of 1 N on ``patch`` along x, y and z."""
        return np.stack([spread(self.mesh, patch, unit, 2) for unit in np.eye(3)], axis=2)

    def weigh(self) -> np.ndarray:
        """Return the loads (n, 3, 3) [N] of 1 m/s² along x, y and z."""
        return (self.motion.masses @ np.ones(len(self.motion.rest)))[:, None, None] * np.eye(3)


def _to_surface(body: Body, whole: Body, level: int) -> sparse.sparray:
    """Return the interpolation from the quadratic elements of a ``level`` to the surface nodes of the finest one."""
    up = sparse.eye_array(len(whole.levels[level + 1].nodes), format="csr")
    for k in range(level, len(body.levels) - 2):
        up = quadratic_prolongation(*whole.levels[k : k + 2]) @ up
    return up.tocsr()[body.fine.surface]


class Modes(NamedTuple):
    """Modes in which the stiffness at rest is the identity, so that coordinates are in √J, and mass is diagonal.

    limit : (n, 3, r), extrapolated to the limit of levels; own : the same on the elements, not extrapolated
    slopes : those that the energy's deformation gradients are taken from; masses : (r,)
    """

    limit: np.ndarray
    own: np.ndarray
    slopes: np.ndarray
    masses: np.ndarray


def limit_modes(rest: BodyAtRest, loads: Sequence[np.ndarray], bent: int) -> Modes:
    """Return modes: responses to ``loads`` (n, 3, 3) [N] of each place, to vibrations, and their second-order ones.

    bent : of how many of the slowest vibrations there are second-order modes, with those of each place
    With the responses Φ, their change D from the coarser level and g = ``rest.gain`` modes are Φ + g D. Their stiffness
    tends to ΦᵀKΦ + g DᵀKD, as levels are nested: a sum of squares, so positive however few digits modes have. That of
    Φ + g D on these elements would be larger; Φ + s D with (1 + s)² = 1 + g has it, and is what ``slopes`` are.
    """
    linear_loads = np.dstack([*loads, rest.inertia])
    answers, changes = rest.answers(linear_loads)
    count = 3 * len(loads)
    groups = [np.dstack([answers[:, :, k : k + 3], answers[:, :, count : count + bent]]) for k in range(0, count, 3)]
    second_loads = np.dstack([bending_loads(rest.elements, u) for u in groups])
    second_answers = rest.answers(second_loads, BEND_RESIDUAL)
    answers, changes = np.dstack([answers, second_answers[0]]), np.dstack([changes, second_answers[1]])
    stiffness, stiff_change = (products(u, rest.elements.multiply(np.ascontiguousarray(u))) for u in (answers, changes))
    basis = independent(stiffness + rest.gain * stiff_change, np.sqrt(stiffness.diagonal()))
    limit, slopes = (answers + share * changes for share in (rest.gain, np.sqrt(1.0 + rest.gain) - 1.0))
    moved = limit @ basis
    masses, turns = np.linalg.eigh(products(moved, rest.motion.masses @ moved.reshape(len(moved), -1)))
    basis = basis @ turns  # in which mass is diagonal, too
    return Modes(limit @ basis, answers @ basis, slopes @ basis, masses)


@dataclass(frozen=True, eq=False)
class ReducedBody:
    """A body ``at_rest`` in ``modes``, with its energy ``model`` of few cubature points.

    held_out : the error of displacements in motions that the points were not fitted to, relative
    seconds : what its preparation has taken, without that of ``at_rest`` [s]
    """

    at_rest: BodyAtRest
    modes: Modes
    model: ReducedEnergy
    held_out: float
    seconds: float

    def project(self, load: np.ndarray) -> np.ndarray:
        """Return the component (r, 1) of a load (n, 3) [N] on the elements along each mode."""
        return np.tensordot(self.modes.limit, load, ((0, 1), (0, 1)))[:, None]

    def on_surface(self, modes: np.ndarray, states: Sequence[np.ndarray]) -> np.ndarray:
        """Return displacements (k, n_surface, 3) [m] of the finest surface at k ``states`` (r, 1) of ``modes``."""
        surface = (self.at_rest.surface @ modes.reshape(len(modes), -1)).reshape(-1, *modes.shape[1:])
        return np.array([surface @ each[:, 0] for each in states])
