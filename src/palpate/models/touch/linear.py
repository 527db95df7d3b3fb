"""Answer a touch with linear responses of its place, and contact solved in them: the classic of haptics.

Linear responses to unit forces on small discs that cover what may be touched (James and Pai 1999, "ArtDefo") are
superposed; ``disc_contact`` finds the forces. Discs press along the inward normals of the surface at rest, whichever
way the instrument comes. *Warped*, responses and normals are turned by the rotations of the summed responses at the
surface, as ``warped_response`` does for presses: a linear body alone is 10 to 20 % too hard.
"""

import numpy as np
from scipy import sparse

from palpate.benchmark.model import Setting
from palpate.benchmark.touch import Touch, TouchCase, TouchDoubted, Touched, TouchSolver, refuse_sticking
from palpate.benchmark.touch_mesh import TouchedMeshes, contact_radius
from palpate.bodies.contacts import spread_over
from palpate.bodies.mesh import Mesh, TetMesh
from palpate.effects.instrument import GRASP, PUNCH, Pose
from palpate.models.contact_modes.elements_at_rest import ElementsAtRest
from palpate.models.touch.disc_contact import OFF, Discs, combined, settle_discs
from palpate.models.touch.reduced_touch import doubt_beyond
from palpate.models.warped_response import NodalSpins, turn, warp
from palpate.solvers.grasping import SMALL, Grasping
from palpate.solvers.indentation import TOUCHED

LAW = "linear"
COLUMN_RESIDUAL = 1e-4
REACH = 1.25
"""Radius of what the discs cover, over that of the deepest contact."""
GRADED = 0.25
"""How much finer discs are in the middle, which is all that shallow touches reach: they are spread over the surface and
round where distances from the place are raised to the power 1 − GRADED. Without it a touch of a body that mostly bends
away was felt 15 % too soft by 40 discs, with it 11 %."""
WIDE = 1.5
"""Radius of a disc over the distance between them."""
STEP, SHARP = 0.25, 0.1
"""Longest step of an instrument over its radius, and of a punch without a rounded edge."""
PLACES = 3
"""Places in which gaps are looked at, by disc."""
SHORTER = (1, 2, 4)
"""Factors for the number of steps that are tried in turn, where the instrument comes too far in one for a solution."""


def settings(case: TouchCase) -> list[Setting]:
    """List the numbers of discs, levels of the mesh and whether responses are warped; of a grasp the levels alone."""
    grid = case.grid.linear
    if case.instrument.kind != GRASP:
        return [dict(each) for each in grid]
    meshes = dict.fromkeys((each.held, each.level) for each in grid)
    return [{"held": held, "level": level} for held, level in meshes]


def online(case: TouchCase, held: int, level: int, discs: int = 0, warped: bool = False) -> TouchSolver:
    """Return the solver of a setting, which prepares places when asked to. LeftOut for an instrument that sticks."""
    if case.instrument.kind == GRASP:
        return GraspedResponses(case, held, level)
    refuse_sticking(case, "linear responses of a place")
    return LinearTouch(case, (held, level), discs, warped)


class LinearTouch(TouchSolver):
    """Linear responses of discs around places, by the node of the place."""

    def __init__(self, case: TouchCase, where: tuple[int, int], discs: int, warped: bool):
        self._case, self._asked = case, (where, discs, warped)
        self._places: dict[int, Discs] = {}

    def prepare(self, touch: Touch) -> None:
        if touch.node not in self._places:
            self._places[touch.node] = _discs(self._case, touch.node, *self._asked)

    def respond(self, touch: Touch) -> Touched:
        """Answer as ``TouchSolver`` does; TouchDoubted where contact is not solved, or beyond what is prepared."""
        discs, body = self._places[touch.node], self._case.body
        doubt_beyond(touch, body.fine.normals[touch.node], self._case.deepest_m)
        forces, error = _settled(discs, touch, touch.pose(body))
        if not error <= OFF:
            raise TouchDoubted(f"contact was left with gaps of {error:.1%} of the depth", [error])
        if not forces.any():
            raise TouchDoubted("no disc is pressed: they are wider than what touches; take more discs", [])
        moved, directions = combined(forces, discs.responses), discs.ways
        if len(discs.spins):
            moved = warp(combined(forces, discs.turns), moved)
            directions = turn(discs.shares @ combined(forces, discs.spins), directions)
        pressures = forces @ discs.shares / discs.areas
        area = discs.areas[pressures > TOUCHED * pressures.max()].sum()
        return Touched(moved, float(forces @ directions @ touch.direction), float(area))


class GraspedResponses(TouchSolver):
    """Linear responses to motions of what is grasped along three axes, by node.

    They are not warped: that would move the patch elsewhere than it is held, by 9 % on average where the liver is
    pulled.
    """

    def __init__(self, case: TouchCase, held: int, level: int):
        self._case, self._where = case, (held, level)
        self._places: dict[int, tuple[np.ndarray, np.ndarray]] = {}

    def prepare(self, touch: Touch) -> None:
        if touch.node in self._places:
            return
        meshes = self._case.share("touched meshes", lambda: TouchedMeshes(self._case.body))
        meshed = meshes.around(touch, *self._where)
        grasping = meshed.problem
        assert isinstance(grasping, Grasping)
        columns = np.stack([grasping.response(axis) for axis in np.eye(3)], axis=2)
        scale = SMALL * grasping.mesh.size
        stiffness = [grasping.reaction(grasping.mesh.nodes + scale * columns[:, :, i]) / scale for i in range(3)]
        self._places[touch.node] = by_column(meshed.up, columns), np.array(stiffness)

    def respond(self, touch: Touch) -> Touched:
        (responses, stiffness), push = self._places[touch.node], touch.depth_m * touch.direction
        return Touched(np.tensordot(push, responses, 1), float(push @ stiffness @ touch.direction))


def _settled(discs: Discs, touch: Touch, begin: Pose) -> tuple[np.ndarray, float]:
    """Return the forces of discs under a touch that begins at ``begin``, and contact's error, as ``settle_discs``."""
    instrument, travel = touch.instrument, touch.depth_m * touch.direction
    # steps are so short that points which enter a punch are nearer to its end than to its side
    edge = max(instrument.edge_m, SHARP * instrument.radius_m)
    longest = edge if instrument.kind == PUNCH else STEP * instrument.radius_m
    least_steps = int(np.ceil(touch.depth_m / longest))
    fixed, tool = (discs.rest, discs.motions, discs.spins, discs.shares), (begin.axes, instrument.shape)
    for factor in SHORTER:
        forces, error = settle_discs(*fixed, begin.tip, travel, factor * least_steps, *tool)
        if error <= OFF:
            break
    return forces, error


def _discs(case: TouchCase, node: int, where: tuple[int, int], count: int, warped: bool) -> Discs:
    """Return ``count`` discs around ``node``, with the linear responses of the body to pressures on them.

    where : levels of the mesh as ``TouchedMeshes.around`` takes them; warped : whether responses turn with the surface
    """
    place, outward, instrument = case.body.fine.nodes[node], case.body.fine.normals[node], case.instrument
    meshes = case.share("touched meshes", lambda: TouchedMeshes(case.body))
    deepest = Touch(instrument, node, -outward, case.deepest_m)
    meshed = meshes.around(deepest, *where)
    points, mesh = meshed.contact.points, meshed.problem.mesh
    point_places, point_normals = points.interpolation @ mesh.nodes, points.interpolation @ mesh.normals
    # centres of the discs among points near the place, denser in the middle
    reach = REACH * contact_radius(instrument, case.deepest_m) + 0.5 * instrument.length_m
    distances = np.linalg.norm(point_places - place, axis=1)
    near = np.flatnonzero(distances <= reach)
    # in graded coordinates what is evenly spaced is denser in the middle of the place
    graded = (point_places - place) * ((np.maximum(distances, 1e-9 * reach) / reach) ** -GRADED)[:, None]
    centers = graded[near[spread_over(graded[near], count)]]
    # pressures of the discs on the points, and the responses to them
    radii_off = np.linalg.norm(graded[:, None] - centers, axis=2) / (WIDE * reach * np.sqrt(np.pi / count))
    pressures = points.areas[:, None] * np.clip(1.0 - radii_off**2, 0.0, None)
    pressures /= pressures.sum(axis=0)
    directions = -pressures.T @ point_normals
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    loads = (points.interpolation.T @ pressures)[:, None, :] * directions.T
    columns = ElementsAtRest(meshed.body, meshed.level).solve(np.ascontiguousarray(loads), COLUMN_RESIDUAL)
    # places where gaps are measured, each with the summed pressures and areas of the points nearest to it
    loaded = np.flatnonzero(pressures.any(axis=1))
    gap_points = loaded[spread_over(graded[loaded], PLACES * count)]
    nearest = np.linalg.norm(graded[loaded][:, None] - graded[gap_points], axis=2).argmin(axis=1)
    shares, areas = np.zeros((len(gap_points), len(centers))), np.zeros(len(gap_points))
    np.add.at(shares, nearest, pressures[loaded])
    np.add.at(areas, nearest, points.areas[loaded])
    spins = surface_spins(mesh, columns) if warped else columns[:, :, :0]  # none
    places, shares = points.interpolation[gap_points], np.ascontiguousarray(shares.T)
    motions, rotations = by_column(places, columns), by_column(places, spins)
    return Discs(
        point_places[gap_points],
        directions,
        motions,
        rotations,
        shares,
        areas,
        by_column(meshed.up, columns),
        by_column(meshed.up, spins),
    )


def by_column(rows: sparse.csr_array, field: np.ndarray) -> np.ndarray:
    """Return the interpolation by ``rows`` (k, n) of each of m columns of ``field`` (n, 3, m), (m, k, 3)."""
    seen = (rows @ field.reshape(len(field), -1)).reshape(rows.shape[0], *field.shape[1:])
    return np.ascontiguousarray(seen.transpose(2, 0, 1))


def surface_spins(mesh: Mesh, columns: np.ndarray) -> np.ndarray:
    """Return rotation vectors (n, 3, m) [rad/N] at the surface of ``mesh`` of ``columns`` (n, 3, m) [m/N]."""
    beside = mesh.tetrahedra[np.isin(mesh.tetrahedra, mesh.surface).any(axis=1)]
    nodes, elements = np.unique(beside, return_inverse=True)
    spins, on_surface = NodalSpins(TetMesh(mesh.nodes[nodes], elements.reshape(-1, 4))), np.zeros_like(columns)
    for i in range(columns.shape[2]):
        on_surface[nodes, :, i] = spins.of(columns[nodes, :, i])
    return on_surface
