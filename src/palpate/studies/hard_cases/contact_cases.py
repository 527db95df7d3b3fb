"""Hard cases of contact: bodies that fall, stack and overlap, and may cross; instruments are in ``touch_cases``."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from palpate.bodies.mesh import Sheet, TetMesh
from palpate.bodies.particles import Particles, merge_particles, solid_particles
from palpate.bodies.simple_shapes import box, sheet
from palpate.collision.contact.obstacles import pieces_of
from palpate.collision.triangles.distance import triangle_pairs_distance
from palpate.scenes.run_scene import run
from palpate.studies.brute_force import crossing
from palpate.studies.hard_cases import stage
from palpate.studies.hard_cases.stage import EXPLICIT, FEM, FIRM, SHAPES, SHEETS, SPRINGS, Answer, Case, refuses

MEETS_WITHIN = 0.002
"""Distance below which bodies count as having met, over the size of the smallest; they repel below half of it."""
MEETS = "least distance of the bodies / the size of one; 1 and more, the number of crossing triangles, if they cross"
LANDS = "least height of the surface over the floor / the body's size; 1 and more if it is below"
MOST_FRAMES = 100
"""Most frames of a motion that are judged, evenly spaced from the first to the last."""

SIZE_M = 0.1
"""Size of the bodies."""


def meeting_error(pairs: list[tuple[np.ndarray, np.ndarray]], size: float = SIZE_M) -> Callable[[np.ndarray], float]:
    """Return the function from frames (k, n, 3) [m] to the error MEETS of a motion.

    pairs : surfaces, as triangles (m, 3) each, that have to come near to each other in some frame, and cross in none
    size : length [m] that distances are divided by
    """

    def error(frames: np.ndarray) -> float:
        crossings = sum(len(crossing([x, x], list(pair))) for x in frames for pair in pairs)
        if crossings:
            return 1.0 + crossings
        return max(min(least_distance(x, *pair, size) for x in frames) for pair in pairs) / size

    return error


def least_distance(x: np.ndarray, one: np.ndarray, other: np.ndarray, most: float) -> float:
    """Return the least distance [m] of two surfaces, triangles (m, 3) at ``x`` (n, 3) [m], but at most ``most`` [m]."""
    corners, other_corners = x[one], x[other]
    near, other_near = _near(corners, other_corners, 0.05 * most), _near(other_corners, corners, 0.05 * most)
    if not near.any() or not other_near.any():
        return most
    rows, columns = (grid.ravel() for grid in np.meshgrid(np.flatnonzero(near), np.flatnonzero(other_near)))
    return min(most, float(triangle_pairs_distance(corners[rows], other_corners[columns])[0].min()))


def _near(corners: np.ndarray, other_corners: np.ndarray, margin: float) -> np.ndarray:
    """Return which triangles, of ``corners`` (m, 3, 3) [m], touch the box of ``other_corners`` plus ``margin`` [m]."""
    lowest, highest = other_corners.min(axis=(0, 1)) - margin, other_corners.max(axis=(0, 1)) + margin
    return ((corners.max(axis=1) >= lowest) & (corners.min(axis=1) <= highest)).all(axis=1)


def landing_error(particles: Particles, height: float) -> Callable[[np.ndarray], float]:
    """Return the function from frames (k, n, 3) [m] to the error LANDS over a floor at ``height`` [m]."""
    surface = np.unique(particles.triangles)
    return lambda frames: clearance(float(frames[:, surface, 2].min() - height) / SIZE_M)


def clearance(relative_distance: float) -> float:
    """Return a distance that is not negative as it is, and 1 plus its magnitude for a negative one, a penetration."""
    return float(relative_distance if relative_distance >= 0.0 else 1.0 - relative_distance)


ERLEBEN = "Erleben 2018"
SOLIDS = (*FEM, *SPRINGS, "shapes_linear")
ALL = (*SOLIDS, *EXPLICIT)


def contacts() -> list[Case]:
    def case(name, scene, expected, run, models=SOLIDS, measure=MEETS, bound=MEETS_WITHIN, **more):
        return Case(name, scene, expected, measure, bound, run, models, **more)

    return [
        case("edge_across_edge", "a tetrahedron falls edge first across the edge of another", "it meets that edge",
             lambda model: _drop(model, [_roof(0.0), _roof(0.0)], [0.0, 0.0, 0.105], 0.12), ALL),
        case("edge_along_edge", "the same with exactly parallel edges", "it meets that edge",
             lambda model: _drop(model, [_roof(0.0), _roof(90.0)], [0.0, 0.0, 0.105], 0.2), source=ERLEBEN),
        case("point_first_cone", "a cone falls on its tip", "it lands on the floor",
             lambda model: _fall(model, _cone(-1.0), 0.15, -0.06), ALL, LANDS),
        case("stack_1_to_100", "a stack of three blocks, the topmost 100 times as heavy", "each lands on the next",
             _stack),
        case("sheet_folded_on_itself", "a sheet hangs by its middle line, and its halves collide", "they meet", _fold,
             SHEETS),
        case("instrument_through_thin_wall", "a capsule moves through a held sheet, 15 times its thickness in one step",
             "the sheet moves with it, or no convergence is reported", _pierce, SHEETS,
             "least distance of the sheet from the capsule / its radius; 1 and more inside or behind it",
             bound=0.1, declared=("stable", "not_converged")),
        case("dropped_from_100_sizes", "a body is dropped from 100 times its size", "it lands on the floor",
             lambda model: _fall(model, block(), 1.8, -10.0), SOLIDS, LANDS),
        *(
            case(f"fall_in_steps_of_{name}_s", f"a block falls on the floor in steps of {name} s",
                 "it lands on the floor", lambda model, h=h: _fall(model, block(), max(0.3, 3 * h), -0.1, h), SOLIDS,
                 LANDS, source="Li et al. 2020 (IPC), time steps")
            for name, h in {"1e-3": 1e-3, "0.1": 0.1, "0.5": 0.5}.items()
        ),
        case("spike_on_spike", "a cone falls tip first on the tip of another", "it meets the tip",
             lambda model: _drop(model, [_cone(1.0), _cone(-1.0)], [0.0, 0.0, 0.205], 0.2), source=ERLEBEN),
        case("spike_in_crack", "a cone falls tip first into a gap narrower than itself", "it meets both walls",
             lambda model: _crack(model, _cone(-1.0)), source=ERLEBEN),
        case("wedge_in_crack", "a wedge falls edge first into a gap narrower than itself", "it meets both walls",
             lambda model: _crack(model, _roof(0.0)), source=ERLEBEN, bounds={"shapes_linear": 0.0015}),
    ]  # fmt: skip


def solid(mesh: TetMesh, held: bool) -> Particles:
    """Make the particles of a mesh of which all nodes are ``held``, or none."""
    anchors = np.arange(len(mesh.nodes)) if held else np.array([], dtype=int)
    return solid_particles(mesh, anchors, FIRM, "body")


def block() -> TetMesh:
    """Make a cube of SIZE_M in 48 tetrahedra."""
    return box([0.1, 0.1, 0.1], [2, 2, 2])


def _roof(degrees: float) -> TetMesh:
    """Make a tetrahedron with an upper edge along x, rotated by ``degrees`` about z, and a perpendicular lower edge."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    flat = 0.05 * np.array([[-1.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, -1.0, -1.0], [0.0, 1.0, -1.0]])
    nodes = flat @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    return _outward(nodes, np.array([[0, 1, 2, 3]]))


def _cone(up: float) -> TetMesh:
    """Make a cone of height 0.1 m around z, its tip up (1) or down (-1)."""
    angles = np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False)
    rim = np.column_stack([0.05 * np.cos(angles), 0.05 * np.sin(angles), np.full(8, -0.05 * up)])
    nodes = np.vstack([rim, [0.0, 0.0, -0.05 * up], [0.0, 0.0, 0.05 * up]])
    return _outward(nodes, np.array([[i, (i + 1) % 8, 8, 9] for i in range(8)]))


def _outward(nodes: np.ndarray, tetrahedra: np.ndarray) -> TetMesh:
    inverted = TetMesh(nodes, tetrahedra).volumes < 0.0
    return TetMesh(nodes, np.where(inverted[:, None], tetrahedra[:, [1, 0, 2, 3]], tetrahedra))


def _drop(model: str, meshes: list[TetMesh], shift: list[float], duration_s: float) -> Answer:
    """Simulate how the second body, moved by ``shift`` (3,) [m], falls on the first, which is held."""
    particles = merge_particles([solid(meshes[0], True), solid(meshes[1], False)], [[0.0] * 3, shift], "hard_case")
    frames = simulated_frames(model, particles, duration_s, {"held": True})
    return Answer(frames, frames[0], meeting_error(surface_pairs(particles, [(0, 1)])))


def surface_pairs(particles: Particles, numbers: list[tuple[int, int]]) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return the triangles (m, 3) of pairs of connected pieces, which are given by their numbers."""
    pieces = pieces_of(particles)
    return [(pieces[i], pieces[j]) for i, j in numbers]


def simulated_frames(
    model: str, particles: Particles, duration_s: float, more: dict, step_s: float | None = None, **contact: Any
) -> np.ndarray:
    """Return positions (k, n, 3) [m], k ≤ MOST_FRAMES, of particles under gravity, ``contact`` and ``more`` effects."""
    time_step = step_s or (0.01 if model in SOLIDS else 2e-4)
    settings = stage.GRAVITY | {"contact": {"friction": 0.3, **contact}} | more
    if model in SHAPES:  # one cluster a piece, and weak damping, so that it falls
        settings |= stage.one_cluster(model) | {"velocity_damping": {"rate_1_s": 0.1}}
    positions = run(stage.scene_of(model, time_step, duration_s, settings, frames=100_000), particles).motion.positions
    stage.check_finite(positions)
    count = len(positions)
    return positions[np.unique(np.linspace(0, count - 1, min(count, MOST_FRAMES)).round().astype(int))]


def _fall(model: str, mesh: TetMesh, duration_s: float, height: float, step_s: float | None = None) -> Answer:
    """Simulate how a body falls on a floor at ``height`` [m]."""
    particles, floor = solid(mesh, False), {"kind": "floor", "height_m": height}
    frames = simulated_frames(model, particles, duration_s, {}, step_s, instruments=[floor])
    return Answer(frames, frames[0], landing_error(particles, height))


def _stack(model: str) -> Answer:
    """Simulate how three blocks, of which the topmost is 100 times as heavy as the others, fall on each other."""
    light = solid(block(), False)
    light = replace(light, masses=0.1 * light.masses)
    heavy = replace(light, masses=100.0 * light.masses)
    particles = merge_particles([light, light, heavy], [[0, 0, 0.005], [0.01, 0, 0.11], [0, 0.01, 0.215]], "hard_case")
    frames = simulated_frames(model, particles, 0.25, {}, instruments=[{"kind": "floor", "height_m": 0.0}])
    on_each_other = meeting_error(surface_pairs(particles, [(0, 1), (1, 2)]))
    on_floor = landing_error(particles, 0.0)
    return Answer(frames, frames[0], lambda a: max(on_each_other(a), on_floor(a)))


def _crack(model: str, mesh: TetMesh) -> Answer:
    """Simulate how a body falls between two held walls whose gap is narrower than the body."""
    wall = solid(box([0.1, 0.2, 0.1], [1, 2, 1]), True)
    shifts = [[-0.12, -0.1, 0.0], [0.02, -0.1, 0.0], [0.001, 0.002, 0.155 - 0.04]]
    particles = merge_particles([wall, wall, solid(mesh, False)], shifts, "hard_case")
    frames = simulated_frames(model, particles, 0.2, {"held": True})
    return Answer(frames, frames[0], meeting_error(surface_pairs(particles, [(0, 2), (1, 2)])))


def _cloth(mesh: Sheet, held: np.ndarray) -> Particles:
    """Make the particles of a sheet whose nodes in the mask ``held`` (n,) do not move."""
    masses = FIRM.density_kg_m3 * mesh.thickness_m * mesh.areas
    fixed = np.flatnonzero(held)
    return Particles("sheet", mesh.nodes, masses, fixed, mesh.triangles, mesh.tetrahedra, FIRM, mesh.thickness_m)


def _fold(model: str) -> Answer:
    """Simulate a sheet held along its middle line, whose halves swing down and collide."""
    mesh = sheet([0.2, 0.1], [8, 4], 0.002)
    particles = _cloth(mesh, np.isclose(mesh.nodes[:, 0], 0.1))
    frames = simulated_frames(model, particles, 0.4, {"held": True}, instruments=[], self_contact=True)
    x, triangles = mesh.nodes[mesh.triangles][:, :, 0], particles.triangles
    halves = triangles[(x < 0.09).all(axis=1)], triangles[(x > 0.11).all(axis=1)]
    return Answer(frames, frames[0], meeting_error([halves], 2.0 * SIZE_M))


def _pierce(model: str) -> Answer:
    """Move a capsule in one step from above a sheet of 2 mm thickness to 0.02 m below it."""
    mesh = sheet([0.2, 0.1], [8, 4], 0.002)
    x, y = mesh.nodes[:, 0], mesh.nodes[:, 1]
    particles = _cloth(mesh, (x == 0.0) | (x == x.max()) | (y == 0.0) | (y == y.max()))
    tool = {"kind": "capsule", "from_m": [0.09, 0.05, 0.01], "to_m": [0.11, 0.05, 0.01], "radius_m": 0.005}
    tool |= {"times_s": [0.0, 0.01], "shifts_m": [[0.0, 0.0, 0.0], [0.0, 0.0, -0.03]]}
    frames = simulated_frames(model, particles, 0.5, {"held": True}, 0.01, instruments=[tool])
    middle = int(np.argmin(np.linalg.norm(mesh.nodes - [0.1, 0.05, 0.0], axis=1)))
    axis = np.array([tool["from_m"], tool["to_m"]]) - [0.0, 0.0, 0.03]
    axis_triangles = np.broadcast_to(axis[[0, 1, 1]], (len(particles.triangles), 3, 3))  # the axis, without area

    def error(frames_shown: np.ndarray) -> float:
        """Measure the least gap after the first step; the capsule is through once the sheet is above its axis."""
        distances = [triangle_pairs_distance(x[particles.triangles], axis_triangles)[0].min() for x in frames_shown[1:]]
        gap = float(min(distances)) / 0.005 - 1.0
        through = bool((frames_shown[1:, middle, 2] > axis[0, 2]).any())
        return 1.0 + gap if through and gap >= 0.0 else clearance(gap)

    return Answer(frames, frames[0], error)


OFF_BALL = "least distance of the body from the ball / its radius; 1 and more inside it"
OFF = 0.01
"""Distance at which a body counts as touching the ball, in its radii."""
STILL = {"gravity": {"acceleration_m_s2": [0.0, 0.0, 0.0]}}


def overlaps() -> list[Case]:
    def case(name, scene, expected, run, models, measure=MEETS, **more):
        bound = MEETS_WITHIN if measure == MEETS else OFF
        return Case(name, scene, expected, measure, bound, run, models, **more)

    boxes = [[0.0, 0.0, 0.0], [0.0, 0.0, 0.05]]
    return [
        case("deep_in_each_other", "two boxes start half inside each other", "refused: no direction of separation",
             refuses(lambda: _separated("fem_implicit", boxes, False)), ("shared_check",), "none",
             declared=("refused",)),
        case("instrument_inside", "a ball starts in the middle of a body", "refused",
             refuses(lambda: _swallowed("fem_implicit", push_out=False)), ("shared_check",), "none",
             declared=("refused",)),
        case("pushed_out_of_each_other", "two boxes start half inside each other, with push_out: true",
             "they are moved apart until they just do not touch", lambda model: _separated(model, boxes, True), ALL),
        case("pushed_out_of_three", "three boxes start inside each other, with push_out: true", "they are moved apart",
             lambda model: _separated(model, [*boxes, [0.06, 0.01, 0.02]], True), ALL),
        case("pushed_out_of_instrument", "a ball starts in the middle of a free body, with push_out: true",
             "the body is moved off the ball", _swallowed, ALL, OFF_BALL),
        case("dented_by_instrument", "a ball starts in the upper side of a held body, with push_out: true",
             "the surface is pressed in", _dented, SOLIDS, OFF_BALL),
    ]  # fmt: skip


def _separated(model: str, shifts: list[list[float]], push_out: bool) -> Answer:
    """Simulate blocks that overlap at first, one at each of ``shifts`` (3,) [m], without gravity."""
    particles = merge_particles([solid(block(), False)] * len(shifts), shifts, "hard_case")
    frames = simulated_frames(model, particles, 0.02, STILL, push_out=push_out)
    pairs = surface_pairs(particles, [(i, j) for i in range(len(shifts)) for j in range(i)])

    def error(a: np.ndarray) -> float:
        """Return the error MEETS, where it is enough that one of the pairs is near."""
        errors = [meeting_error([pair])(a) for pair in pairs]
        return max(errors) if max(errors) > 1.0 else min(errors)

    return Answer(frames, particles.nodes, error)


def _swallowed(model: str, push_out: bool = True) -> Answer:
    """Simulate a free block with a ball in its middle at the start, without gravity."""
    particles, center = solid(block(), False), np.array([0.05, 0.05, 0.05])
    ball = {"kind": "sphere", "center_m": center.tolist(), "radius_m": 0.02}
    frames = simulated_frames(model, particles, 0.02, STILL, instruments=[ball], push_out=push_out)

    def error(a: np.ndarray) -> float:
        """Measure the least distance of the ball from the bounding box of the block, which stays a block."""
        nearest = np.clip(center, a.min(axis=1), a.max(axis=1))
        return clearance(np.linalg.norm(center - nearest, axis=1).min() / 0.02 - 1.0)

    return Answer(frames, particles.nodes, error)


def _dented(model: str) -> Answer:
    """Simulate a block with a held lower side, into whose upper side a ball reaches by 5 mm at the start."""
    mesh = box([0.1, 0.1, 0.1], [4, 4, 4])
    particles = solid_particles(mesh, np.flatnonzero(mesh.nodes[:, 2] == 0.0), FIRM, "body")
    center = np.array([0.05, 0.05, 0.115])
    ball = {"kind": "sphere", "center_m": center.tolist(), "radius_m": 0.02}
    frames = simulated_frames(model, particles, 0.1, {"held": True}, instruments=[ball], push_out=True)
    top = mesh.nodes[:, 2] == 0.1

    def error(a: np.ndarray) -> float:
        return clearance((min(np.linalg.norm(x[top] - center, axis=1).min() for x in a) - 0.02) / 0.02)

    return Answer(frames, particles.nodes, error)
