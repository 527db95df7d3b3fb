"""Hard cases of contact: touches, falls and stacks in which bodies may penetrate each other."""

from dataclasses import replace
from typing import Any

import numpy as np

from palpate.bodies.box import box
from palpate.bodies.mesh import TetMesh
from palpate.bodies.particles import Particles, merge_particles, solid_particles
from palpate.bodies.sheet import sheet
from palpate.collision.contact.barrier_contact import pieces_of
from palpate.evaluation.collision.brute_force import crossing
from palpate.evaluation.hard_cases.hard_case import Case, finite
from palpate.evaluation.hard_cases.stage import EXPLICIT, FEM, FIRM, SHEETS, SPRINGS, play
from palpate.scenes.motion import Motion

ERLEBEN = "Erleben 2018"
SOLIDS = (*FEM, *SPRINGS, "shapes_linear")
ALL = (*SOLIDS, *EXPLICIT)
GRAVITY = {"gravity": {"acceleration_m_s2": [0.0, 0.0, -9.81]}}
CROSSING = "pairs of crossing triangles of different pieces, summed over all frames"
BELOW = "largest depth of a surface node below the floor / the body's size"
STEP_S = {"fem_implicit": 0.01, "springs_implicit": 0.01, "shapes_linear": 0.01}
SHORT_S = 2e-4


def cases() -> list[Case]:
    """Return the declared cases of this family."""

    def case(name, scene, expected, measure, bound, run, models=SOLIDS, declared=None, source="palpate"):
        words = (name, "contact", source, scene, expected, measure, bound)
        return Case.of(*words, run=run, models=models, declared=declared)

    refused = dict.fromkeys(ALL, ("refused",))
    return [
        case("deep_in_each_other", "two boxes start half inside each other", "refused: no direction of separation",
             CROSSING, 0.0, lambda model: _meet(model, [_block(), _block()], [0.0, 0.0, 0.05], 0.05), ALL, refused),
        case("instrument_inside", "a ball starts in the middle of a body", "refused", CROSSING, 0.0, _swallowed, ALL,
             refused),
        case("edge_across_edge", "a tetrahedron falls edge first across the edge of another", "no penetration",
             CROSSING, 0.0, lambda model: _meet(model, [_roof(0.0), _roof(0.0)], [0.0, 0.0, 0.105], 0.12), ALL),
        case("edge_along_edge", "the same with exactly parallel edges", "no penetration", CROSSING, 0.0,
             lambda model: _meet(model, [_roof(0.0), _roof(90.0)], [0.0, 0.0, 0.105], 0.2), source=ERLEBEN),
        case("point_first_cone", "a cone falls on its tip", "it stays above the floor", BELOW, 0.0, _cone_falls, ALL),
        case("stack_1_to_100", "a stack of three blocks, the topmost 100 times as heavy", "no penetration", CROSSING,
             0.0, _stack, SOLIDS),
        case("sheet_folded_on_itself", "a sheet hangs by its middle line, and its halves collide",
             "no self-penetration", "pairs of crossing triangles of the sheet, summed over all frames", 0.0, _fold,
             SHEETS),
        case("instrument_through_thin_wall", "a capsule moves through a held sheet, 15 times its thickness in one step",
             "the sheet moves with it, or no convergence is reported", "distance of the sheet's middle behind "
             "the capsule / its radius", 0.0, _pierce, SHEETS, dict.fromkeys(SHEETS, ("stable", "not_converged"))),
        case("dropped_from_100_sizes", "a body is dropped from 100 times its size", "it stays above the floor", BELOW,
             0.0, _drop, SOLIDS),
        *(
            case(f"fall_in_steps_of_{name}_s", f"a block falls on the floor in steps of {name} s",
                 "it stays above the floor", BELOW, 0.0, lambda model, h=h: _fall(model, h), SOLIDS,
                 source="Li et al. 2020 (IPC), time steps")
            for name, h in {"1e-3": 1e-3, "0.1": 0.1, "0.5": 0.5}.items()
        ),
        case("spike_on_spike", "a cone falls tip first on the tip of another", "no penetration", CROSSING,
             0.0, lambda model: _meet(model, [_cone(1.0), _cone(-1.0)], [0.0, 0.0, 0.205], 0.2), source=ERLEBEN),
        case("spike_in_crack", "a cone falls tip first into a gap narrower than itself", "no penetration of walls",
             CROSSING, 0.0, lambda model: _crack(model, _cone(-1.0)), source=ERLEBEN),
        case("wedge_in_crack", "a wedge falls edge first into a gap narrower than itself", "no penetration of walls",
             CROSSING, 0.0, lambda model: _crack(model, _roof(0.0)), source=ERLEBEN),
    ]  # fmt: skip


def _nodes(mesh: TetMesh, held: bool) -> Particles:
    kept = np.arange(len(mesh.nodes)) if held else np.array([], dtype=int)
    return solid_particles(mesh, kept, FIRM, "body")


def _block() -> TetMesh:
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


def _meet(model: str, meshes: list[TetMesh], shift: list[float], duration_s: float) -> float:
    """Drop the second body on the first, which is held, and count crossing triangles in all frames."""
    particles = merge_particles([_nodes(meshes[0], True), _nodes(meshes[1], False)], [[0.0] * 3, shift], "hard_case")
    return _crossings(particles, _played(model, particles, duration_s, {"held": None}))


def _played(
    model: str, particles: Particles, duration_s: float, more: dict, step_s: float | None = None, **contact: Any
) -> Motion:
    """Simulate the motion under gravity with contact and keep every step."""
    h = step_s or STEP_S.get(model, SHORT_S)
    settings = GRAVITY | {"contact": {"friction": 0.3, **contact}} | more
    if model == "shapes_linear":  # one cluster a piece, and weak damping, so that it falls
        settings |= {"shape_matching": SHAPED, "velocity_damping": {"rate_1_s": 0.1}}
    motion = play(model, particles, h, duration_s, settings, frames=100_000)
    finite(motion.positions)
    return motion


SHAPED = {"mode": "linear", "alpha": 0.5, "beta": 0.5, "clusters": {"kind": "one"}}


def _crossings(particles: Particles, motion: Motion) -> float:
    _check_touched(motion)
    pieces, count = pieces_of(particles), 0
    for x in motion.positions:
        for i, one in enumerate(pieces):
            for other in pieces[i + 1 :]:
                count += len(crossing([x, x], [one, other]))
    return float(count)


def _check_touched(motion: Motion) -> None:
    """Raise AssertionError if nothing touched, since such a scene tests nothing."""
    if motion.contacts.empty:
        raise AssertionError("nothing ever touched")


def _below(motion: Motion, height: float) -> float:
    """Return the largest depth of the surface below a floor / the body's size; inner nodes do not count."""
    lowest = motion.positions[:, np.unique(motion.triangles), 2].min()
    return float(height - lowest) / float(np.ptp(motion.rest, axis=0).max())


def _swallowed(model: str) -> float:
    ball = {"kind": "sphere", "center_m": [0.05, 0.05, 0.05], "radius_m": 0.02}
    return _below(_played(model, _nodes(_block(), False), 0.05, {}, instruments=[ball]), 0.0)


def _floor(height: float) -> list[dict]:
    return [{"kind": "floor", "height_m": height}]


def _cone_falls(model: str) -> float:
    return _below(_played(model, _nodes(_cone(-1.0), False), 0.15, {}, instruments=_floor(-0.06)), -0.06)


def _stack(model: str) -> float:
    light = _nodes(_block(), False)
    light = replace(light, masses=0.1 * light.masses)
    heavy = replace(light, masses=100.0 * light.masses)
    particles = merge_particles([light, light, heavy], [[0, 0, 0.005], [0.01, 0, 0.11], [0, 0.01, 0.215]], "hard_case")
    motion = _played(model, particles, 0.25, {}, instruments=_floor(0.0))
    return _crossings(particles, motion) + max(0.0, _below(motion, 0.0))


def _fall(model: str, h: float) -> float:
    return _below(_played(model, _nodes(_block(), False), max(0.3, 3 * h), {}, h, instruments=_floor(-0.1)), -0.1)


def _drop(model: str) -> float:
    return _below(_played(model, _nodes(_block(), False), 1.8, {}, instruments=_floor(-10.0)), -10.0)


def _crack(model: str, mesh: TetMesh) -> float:
    wall = _nodes(box([0.1, 0.2, 0.1], [1, 2, 1]), True)
    shifts = [[-0.12, -0.1, 0.0], [0.02, -0.1, 0.0], [0.001, 0.002, 0.155 - 0.04]]
    particles = merge_particles([wall, wall, _nodes(mesh, False)], shifts, "hard_case")
    return _crossings(particles, _played(model, particles, 0.2, {"held": None}))


def _cloth(divisions: list[int], held: np.ndarray) -> Particles:
    mesh = sheet([0.2, 0.1], divisions, 0.002)
    masses = FIRM.density_kg_m3 * mesh.thickness_m * mesh.areas
    return Particles("sheet", mesh.nodes, masses, held, mesh.triangles, mesh.tetrahedra, FIRM, mesh.thickness_m)


def _fold(model: str) -> float:
    """Simulate a sheet that hangs by its middle line, so that both halves swing down and collide."""
    mesh = sheet([0.2, 0.1], [8, 4], 0.002)
    particles = _cloth([8, 4], np.flatnonzero(np.isclose(mesh.nodes[:, 0], 0.1)))
    motion = _played(model, particles, 0.4, {"held": None}, instruments=[], self_contact=True)
    _check_touched(motion)
    return float(sum(len(crossing([x], [particles.triangles])) for x in motion.positions))


def _pierce(model: str) -> float:
    """Move a capsule in one step from above a sheet of 2 mm thickness to 0.02 m below it."""
    mesh = sheet([0.2, 0.1], [8, 4], 0.002)
    x, y = mesh.nodes[:, 0], mesh.nodes[:, 1]
    particles = _cloth([8, 4], np.flatnonzero((x == 0.0) | (x == x.max()) | (y == 0.0) | (y == y.max())))
    tool = {"kind": "capsule", "from_m": [0.09, 0.05, 0.01], "to_m": [0.11, 0.05, 0.01], "radius_m": 0.005}
    tool |= {"times_s": [0.0, 0.01], "shifts_m": [[0.0, 0.0, 0.0], [0.0, 0.0, -0.03]]}
    motion = _played(model, particles, 0.05, {"held": None}, 0.01, instruments=[tool])
    _check_touched(motion)
    middle = int(np.argmin(np.linalg.norm(mesh.nodes - [0.1, 0.05, 0.0], axis=1)))
    return float((motion.positions[1:, middle, 2] - (0.01 - 0.03 - 0.005)).max()) / 0.005
