"""Hard cases of contact: touches, falls and stacks in which bodies may penetrate each other."""

from dataclasses import replace
from typing import Any

import numpy as np

from palpate.bodies.box import box
from palpate.bodies.mesh import TetMesh
from palpate.bodies.particles import Particles, merge_particles, solid_particles
from palpate.bodies.sheet import sheet
from palpate.collision.contact.obstacles import pieces_of
from palpate.scenes.motion import Motion
from palpate.studies.hard_cases.contact_measures import (
    LANDS,
    MEETS,
    NEAR,
    Surfaces,
    answer,
    distance_of_axis,
    frames,
    lands,
    meets,
)
from palpate.studies.hard_cases.hard_case import Answer, Case, finite
from palpate.studies.hard_cases.stage import EXPLICIT, FEM, FIRM, SHEETS, SPRINGS, play

ERLEBEN = "Erleben 2018"
SOLIDS = (*FEM, *SPRINGS, "shapes_linear")
ALL = (*SOLIDS, *EXPLICIT)
GRAVITY = {"gravity": {"acceleration_m_s2": [0.0, 0.0, -9.81]}}
STEP_S = {"fem_implicit": 0.01, "springs_implicit": 0.01, "shapes_linear": 0.01}
SHORT_S = 2e-4
SIZE_M = 0.1
"""Size of the bodies."""


def cases() -> list[Case]:
    """Return the declared cases of this family."""

    def case(name, scene, expected, run, models=SOLIDS, measure=MEETS, declared=None, source="palpate", bound=NEAR):
        words = (name, "contact", source, scene, expected, measure, bound)
        return Case.of(*words, run=run, models=models, declared=declared)

    return [
        case("edge_across_edge", "a tetrahedron falls edge first across the edge of another", "it meets that edge",
             lambda model: _meet(model, [_roof(0.0), _roof(0.0)], [0.0, 0.0, 0.105], 0.12), ALL),
        case("edge_along_edge", "the same with exactly parallel edges", "it meets that edge",
             lambda model: _meet(model, [_roof(0.0), _roof(90.0)], [0.0, 0.0, 0.105], 0.2), source=ERLEBEN),
        case("point_first_cone", "a cone falls on its tip", "it lands on the floor", _cone_falls, ALL, LANDS),
        case("stack_1_to_100", "a stack of three blocks, the topmost 100 times as heavy", "each lands on the next",
             _stack),
        case("sheet_folded_on_itself", "a sheet hangs by its middle line, and its halves collide", "they meet", _fold,
             SHEETS),
        case("instrument_through_thin_wall", "a capsule moves through a held sheet, 15 times its thickness in one step",
             "the sheet moves with it, or no convergence is reported", _pierce, SHEETS,
             "least distance of the sheet from the capsule / its radius; 1 and more inside or behind it",
             dict.fromkeys(SHEETS, ("stable", "not_converged")), bound=0.1),
        case("dropped_from_100_sizes", "a body is dropped from 100 times its size", "it lands on the floor", _drop,
             SOLIDS, LANDS),
        *(
            case(f"fall_in_steps_of_{name}_s", f"a block falls on the floor in steps of {name} s",
                 "it lands on the floor", lambda model, h=h: _fall(model, h), SOLIDS, LANDS,
                 source="Li et al. 2020 (IPC), time steps")
            for name, h in {"1e-3": 1e-3, "0.1": 0.1, "0.5": 0.5}.items()
        ),
        case("spike_on_spike", "a cone falls tip first on the tip of another", "it meets the tip",
             lambda model: _meet(model, [_cone(1.0), _cone(-1.0)], [0.0, 0.0, 0.205], 0.2), source=ERLEBEN),
        case("spike_in_crack", "a cone falls tip first into a gap narrower than itself", "it meets both walls",
             lambda model: _crack(model, _cone(-1.0)), source=ERLEBEN),
        case("wedge_in_crack", "a wedge falls edge first into a gap narrower than itself", "it meets both walls",
             lambda model: _crack(model, _roof(0.0)), source=ERLEBEN),
    ]  # fmt: skip


def solid(mesh: TetMesh, held: bool) -> Particles:
    """Make particles of a mesh with all of its nodes ``held``, or none."""
    kept = np.arange(len(mesh.nodes)) if held else np.array([], dtype=int)
    return solid_particles(mesh, kept, FIRM, "body")


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


def _meet(model: str, meshes: list[TetMesh], shift: list[float], duration_s: float) -> Answer:
    """Drop the second body on the first, which is held."""
    particles = merge_particles([solid(meshes[0], True), solid(meshes[1], False)], [[0.0] * 3, shift], "hard_case")
    found = frames(played(model, particles, duration_s, {"held": None}))
    return answer(found, meets(pairs_of(particles, [(0, 1)]), SIZE_M))


def pairs_of(particles: Particles, which: list[tuple[int, int]]) -> Surfaces:
    """Return the surfaces of pairs of pieces, given by their numbers."""
    pieces = pieces_of(particles)
    return [(pieces[i], pieces[j]) for i, j in which]


def played(
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


def _surface(particles: Particles) -> np.ndarray:
    return np.unique(particles.triangles)


def _floor(height: float) -> list[dict]:
    return [{"kind": "floor", "height_m": height}]


def _lands(motion: Motion, particles: Particles, height: float) -> Answer:
    return answer(frames(motion), lands(_surface(particles), height, SIZE_M))


def _cone_falls(model: str) -> Answer:
    particles = solid(_cone(-1.0), False)
    return _lands(played(model, particles, 0.15, {}, instruments=_floor(-0.06)), particles, -0.06)


def _stack(model: str) -> Answer:
    light = solid(block(), False)
    light = replace(light, masses=0.1 * light.masses)
    heavy = replace(light, masses=100.0 * light.masses)
    particles = merge_particles([light, light, heavy], [[0, 0, 0.005], [0.01, 0, 0.11], [0, 0.01, 0.215]], "hard_case")
    found = frames(played(model, particles, 0.25, {}, instruments=_floor(0.0)))
    on_each_other, on_floor = (
        meets(pairs_of(particles, [(0, 1), (1, 2)]), SIZE_M),
        lands(_surface(particles), 0.0, SIZE_M),
    )
    return answer(found, lambda a: max(on_each_other(a), on_floor(a)))


def _fall(model: str, h: float) -> Answer:
    particles = solid(block(), False)
    return _lands(played(model, particles, max(0.3, 3 * h), {}, h, instruments=_floor(-0.1)), particles, -0.1)


def _drop(model: str) -> Answer:
    particles = solid(block(), False)
    return _lands(played(model, particles, 1.8, {}, instruments=_floor(-10.0)), particles, -10.0)


def _crack(model: str, mesh: TetMesh) -> Answer:
    wall = solid(box([0.1, 0.2, 0.1], [1, 2, 1]), True)
    shifts = [[-0.12, -0.1, 0.0], [0.02, -0.1, 0.0], [0.001, 0.002, 0.155 - 0.04]]
    particles = merge_particles([wall, wall, solid(mesh, False)], shifts, "hard_case")
    found = frames(played(model, particles, 0.2, {"held": None}))
    return answer(found, meets(pairs_of(particles, [(0, 2), (1, 2)]), SIZE_M))


def _cloth(divisions: list[int], held: np.ndarray) -> Particles:
    mesh = sheet([0.2, 0.1], divisions, 0.002)
    masses = FIRM.density_kg_m3 * mesh.thickness_m * mesh.areas
    return Particles("sheet", mesh.nodes, masses, held, mesh.triangles, mesh.tetrahedra, FIRM, mesh.thickness_m)


def _fold(model: str) -> Answer:
    """Simulate a sheet that hangs by its middle line, so that both halves swing down and collide."""
    mesh = sheet([0.2, 0.1], [8, 4], 0.002)
    particles = _cloth([8, 4], np.flatnonzero(np.isclose(mesh.nodes[:, 0], 0.1)))
    found = frames(played(model, particles, 0.4, {"held": None}, instruments=[], self_contact=True))
    x, triangles = mesh.nodes[mesh.triangles][:, :, 0], particles.triangles
    halves = triangles[(x < 0.09).all(axis=1)], triangles[(x > 0.11).all(axis=1)]
    return answer(found, meets([halves], 2.0 * SIZE_M))


def _pierce(model: str) -> Answer:
    """Move a capsule in one step from above a sheet of 2 mm thickness to 0.02 m below it."""
    mesh = sheet([0.2, 0.1], [8, 4], 0.002)
    x, y = mesh.nodes[:, 0], mesh.nodes[:, 1]
    particles = _cloth([8, 4], np.flatnonzero((x == 0.0) | (x == x.max()) | (y == 0.0) | (y == y.max())))
    tool = {"kind": "capsule", "from_m": [0.09, 0.05, 0.01], "to_m": [0.11, 0.05, 0.01], "radius_m": 0.005}
    tool |= {"times_s": [0.0, 0.01], "shifts_m": [[0.0, 0.0, 0.0], [0.0, 0.0, -0.03]]}
    found = frames(played(model, particles, 0.5, {"held": None}, 0.01, instruments=[tool]))
    middle = int(np.argmin(np.linalg.norm(mesh.nodes - [0.1, 0.05, 0.0], axis=1)))
    axis = np.array([tool["from_m"], tool["to_m"]]) - [0.0, 0.0, 0.03]

    def error(a: np.ndarray) -> float:
        """Measure the frames after the first step; through the sheet is as far as the other side of the axis."""
        clear = min(distance_of_axis(x, particles.triangles, axis) for x in a[1:]) / 0.005 - 1.0
        behind = bool((a[1:, middle, 2] > axis[0, 2]).any())
        return 1.0 - clear if clear < 0.0 else 1.0 + clear if behind else clear

    return answer(found, error)
