"""Hard cases of instruments that are pressed into tissue: their places, depths and shapes, materials and supports."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import cast

import numpy as np

from palpate.bodies.body import Body, nest
from palpate.bodies.material import LAWS, Material, exponential
from palpate.bodies.mesh import TetMesh
from palpate.bodies.refinement import with_midpoints
from palpate.bodies.simple_shapes import box
from palpate.bodies.supports import Bed
from palpate.effects.instrument import Instrument, first_touch, upright
from palpate.solvers.indentation import Indentation, contact_points
from palpate.studies.hard_cases.stage import SOFT, Answer, Case

MODELS = ("fem_quadratic",)
DOWN = np.array([0.0, 0.0, -1.0])
OBLIQUE = np.array([np.sqrt(0.5), 0.0, -np.sqrt(0.5)])
DEPTH_M = 0.003
BALL = Instrument("sphere", 0.02)
TOUCHES = "least distance of the surface from the instrument, or of nodes that it does not touch from balance"
MEASURE = f"{TOUCHES}, over the depth or the force"
OFF_REST = "largest distance of a node from rest / the depth"
WITHIN = 0.02
TOP = (0.05, 0.05)
"""Middle of the block's upper side [m], a node."""


def cases() -> list[Case]:
    def case(name, scene, run, expected="it touches, and forces balance", bound=WITHIN, declared=("stable",)):
        return Case(f"touch_{name}", scene, expected, MEASURE, bound, run, MODELS, declared)

    def off_rest(name, scene, run):
        return Case(f"touch_{name}", scene, "the body is at rest, without force", OFF_REST, 1e-6, run, MODELS)

    either, refused = ("stable", "not_converged"), ("refused",)
    return [
        case("at_a_node", "a ball touches a block first exactly at a node", _pressed),
        case("at_an_edge", "the same, exactly at the middle of an edge", partial(_pressed, at=(0.0625, 0.05))),
        case("on_a_face", "the same, within a face",
             partial(_pressed, at=(0.058, 0.053), instrument=Instrument("sphere", 0.04))),
        case("at_a_corner", "a ball touches a cube first at its corner",
             partial(_pressed, at=(0.1, 0.1), direction=-np.ones(3) / np.sqrt(3.0), depth=0.006), bound=0.005),
        case("in_a_groove", "a ball is pressed into a groove and touches both sides", partial(_pressed, make=_groove)),
        case("two_1_mm_apart", "two balls are pressed, 1 mm apart", partial(_pressed, at=(0.0295, 0.05), beside=0.041)),
        case("larger_than_the_body", "a ball of 1 m is pressed on a block of 0.1 m",
             partial(_pressed, instrument=Instrument("sphere", 1.0))),
        case("tiny", "a ball of a twelfth of an element's length",
             partial(_pressed, instrument=Instrument("sphere", 0.002), depth=0.0005),
             "it is told that elements are too large", declared=("not_converged",)),
        case("capsule", "a capsule lies on the block",
             partial(_pressed, instrument=Instrument("capsule", 0.01, length_m=0.03))),
        case("sharp_punch", "a flat punch without a rounded edge",
             partial(_pressed, instrument=Instrument("punch", 0.02))),
        case("stuck_oblique", "a ball that sticks is pushed at 45°", partial(_pressed, direction=OBLIQUE, sticks=True)),
        case("incompressible", "ν = 0.4999", partial(_pressed, make=_incompressible)),
        case("of_another_law", "a stable neo-Hookean block",
             partial(_pressed, make=lambda: _block(replace(SOFT, law=LAWS[1])))),
        case("of_a_stiffening_law", "a block whose stiffness grows exponentially, pressed by 30 % of its thickness",
             partial(_pressed, make=lambda: _block(replace(SOFT, law=exponential(20.0))), depth=0.015)),
        case("on_a_sliver", "an element of 1° lies under the tip", partial(_pressed, make=_sliver)),
        case("on_a_bed", "the block rests on springs", partial(_pressed, make=_bedded)),
        case("at_the_rim_of_held_nodes", "a ball touches first where held nodes of the upper side end",
             partial(_pressed, make=lambda: _block(held=_half_held), at=(0.0375, 0.05)), declared=either),
        case("at_held_nodes", "a ball is pressed on nodes that do not move",
             partial(_pressed, make=lambda: _block(held=lambda x: x[:, 2] > -1.0)), "no convergence is reported",
             declared=("not_converged",)),
        off_rest("depth_0", "a depth of 0 is asked for", partial(_pulled_back, depths=[0.0])),
        off_rest("pulled_back", "a ball is pressed and pulled back to first touch",
                 partial(_pulled_back, depths=[DEPTH_M, 0.0])),
        off_rest("pulled_back_stuck", "the same, and it sticks while it presses",
                 partial(_pulled_back, depths=[DEPTH_M, 0.5 * DEPTH_M, 0.0], sticks=True)),
        case("nearly_through", "a ball of 5 mm is pressed through nine tenths of the block",
             partial(_pressed, instrument=Instrument("sphere", 0.005), depth=0.045), "equilibrium, or it is told",
             declared=either),
        case("through", "a ball is pressed farther than the block is thick", partial(_pressed, depth=0.051), "refused",
             declared=refused),
        case("depth_negative", "a negative depth is asked for", partial(_pressed, depth=-0.001), "refused",
             declared=refused),
        case("radius_nan", "an instrument's radius is not a number",
             lambda model: _pressed(model, instrument=Instrument("sphere", np.nan)), "refused", declared=refused),
        case("beside_the_body", "a ball is pressed where nothing is", partial(_pressed, at=(0.2, 0.05)), "refused",
             declared=refused),
    ]  # fmt: skip


def _block(
    material: Material = SOFT,
    held: Callable = lambda x: x[:, 2] == 0.0,
    mesh: TetMesh | None = None,
    bed: Bed | None = None,
) -> Body:
    """Make a block of 0.1 m × 0.1 m × 0.05 m in 192 tetrahedra, or of ``mesh``, held where ``held(nodes)`` is true."""
    mesh = box([0.1, 0.1, 0.05], [4, 4, 2]) if mesh is None else mesh
    return with_midpoints(nest("block", mesh, 0, np.flatnonzero(held(mesh.nodes)), material, bed=bed), 0)


def _incompressible() -> Body:
    """Make the block of ν = 0.4999, on a coarser mesh, as conjugate gradients take hundreds of steps."""
    return _block(replace(SOFT, poisson=0.4999), mesh=box([0.1, 0.1, 0.05], [2, 2, 2]))


def _half_held(x: np.ndarray) -> np.ndarray:
    """Return the mask (n,) of nodes (n, 3) [m] on the lower side and on a part of the upper side."""
    return (x[:, 2] == 0.0) | ((x[:, 2] == 0.05) & (x[:, 0] < 0.04))


def _moved(shift: Callable[[np.ndarray], np.ndarray]) -> Body:
    """Make the block with nodes moved up by ``shift``, a function from nodes (n, 3) [m] to distances (n,) [m]."""
    mesh = box([0.1, 0.1, 0.05], [4, 4, 2])
    return _block(mesh=TetMesh(mesh.nodes + np.outer(shift(mesh.nodes), -DOWN), mesh.tetrahedra))


def _groove() -> Body:
    return _moved(lambda x: np.where((x[:, 2] == 0.05) & (x[:, 0] == 0.05), -0.02, 0.0))


def _sliver() -> Body:
    """Make the block with the node below the instrument's tip moved almost to the upper side."""
    up = 0.025 - 0.025 * np.tan(np.radians(1))
    return _moved(lambda x: np.where((np.abs(x - [*TOP, 0.025]) < 1e-9).all(axis=1), up, 0.0))


def _bedded() -> Body:
    bed = Bed(np.array([0.05, 0.05, 0.0]), 0.2, 4e5, DOWN)
    return _block(held=lambda x: np.zeros(len(x), dtype=bool), bed=bed)


def _problem(
    body: Body, instrument: Instrument, at: Sequence[float], direction: np.ndarray, beside: float, sticks: bool
) -> Indentation:
    """Place an instrument in first touch of a block, above ``at`` (2,) [m], and another ``beside`` [m] it unless 0."""
    tops = [np.array([at[0] + shift, at[1], 0.05]) for shift in ((0.0, beside) if beside else (0.0,))]
    poses = [
        first_touch(upright(instrument, top, -direction if at[1] > 0.09 else -DOWN), body.coarse, direction)
        for top in tops
    ]
    points = contact_points(cast(TetMesh, body.levels[0]), 2, SOFT.young_pa, lambda p: p[:, 2] > 0.02)
    return Indentation(body, 0, 2, points, poses, sticks)


def _pressed(
    model: str,
    make: Callable[[], Body] = _block,
    instrument: Instrument = BALL,
    at: Sequence[float] = TOP,
    direction: np.ndarray = DOWN,
    depth: float = DEPTH_M,
    beside: float = 0.0,
    sticks: bool = False,
) -> Answer:
    """Press an instrument into a block along ``direction`` to ``depth`` [m], as ``_problem`` places it.

    The error is the larger of the surface's distance from an instrument over the depth, and of the residual force of
    nodes that no instrument touches over the instruments' force.
    """
    problem = _problem(make(), instrument, at, direction, beside, sticks)
    (state,) = problem.push(direction, [depth], 1e-6)

    def error(x: np.ndarray) -> float:
        points, touched = problem.points, np.zeros(len(x), dtype=bool)
        at_points, distances = points.interpolation @ x, []
        for side in problem._sides:
            distances.append(abs(float(side.pose.gaps(at_points)[0].min())))
            touched[(points.interpolation.T @ (side.multiplier > 0.0)) != 0.0] = True
        residual = problem.force(x) - problem.points.spread @ sum(problem.pushes(x))
        force_error = float(np.linalg.norm(residual[~touched]) / np.linalg.norm(state.force))
        return max(max(distances) / depth, force_error)

    return Answer(state.x, problem.mesh.nodes, error)


def _pulled_back(model: str, depths: list[float], sticks: bool = False) -> Answer:
    """Press a ball along ``depths`` [m], the last one 0, where the body is at rest; frozen is the pressed body."""
    body = _block()
    (pressed,) = _problem(body, BALL, TOP, DOWN, 0.0, sticks).push(DOWN, [DEPTH_M], 1e-6)
    problem = _problem(body, BALL, TOP, DOWN, 0.0, sticks)
    final = list(problem.push(DOWN, depths, 1e-6))[-1]
    if final.force.any() or final.area_m2 or final.pressure_pa:
        raise AssertionError(f"there is a force of {final.force} N without contact")
    rest = problem.mesh.nodes
    return Answer(final.x, pressed.x, lambda a: float(np.abs(a - rest).max() / DEPTH_M))
