"""Paper 3's trade of precision for time: contacts from trees stopped at a layer, and queries of bodies apart."""

from collections.abc import Callable, Iterator
from itertools import product
from typing import Any, NamedTuple

import numba
import numpy as np
import pandas as pd
from scipy.spatial import KDTree

from palpate.bodies.surfaces.remesh import area_normals
from palpate.bodies.surfaces.triangles import part_centres, polydata
from palpate.collision.contact_points import Contacts, stopped_contacts, triangle_contacts
from palpate.collision.trees.build_tree import CHILD, KIND
from palpate.collision.trees.tree import Tree
from palpate.collision.trees.tree_query import StoppedTree, candidates, overlapping_trees
from palpate.collision.trees.volumes import volumes_overlap
from palpate.collision.triangles.distance import triangle_pairs_distance
from palpate.studies.brute_force import crossing
from palpate.studies.collision.compare_trees import PURE, RefittedTrees, contenders, timed
from palpate.studies.collision.settings import Apart, Stopped
from palpate.studies.prescribed_motions import (
    Moving,
    instrument_approach,
    instrument_press,
    livers_apart,
    turned,
    two_bodies,
    two_livers,
)
from palpate.table_declaration import Table


class Overlap(NamedTuple):
    """The overlap of a body a with a body b.

    place : (3,) [m], and direction : (3,) in which a has to move to separate: means over those parts of both surfaces
        that are inside the other body, weighted with the depth
    depth : [m] the largest; velocity : (3,) [m/s] of a relative to b at the place
    """

    place: np.ndarray
    direction: np.ndarray
    depth: float
    velocity: np.ndarray


def distance(points: list[np.ndarray], trees: list[Tree]) -> float:
    """Compute the distance [m] of two surfaces; 0 if they cross.

    points : (n, 3) [m] of each; trees : sphere trees over the triangles of each, which are refitted
    """
    node_distance = float(KDTree(points[0]).query(points[1])[0].min())
    for tree, new_points in zip(trees, points, strict=True):
        tree.refit(new_points, margin=0.5 * node_distance * (1.0 + 1e-9))
    pairs, _ = candidates(*trees)
    corners = (at[tree.triangles[pairs[:, side]]] for side, (at, tree) in enumerate(zip(points, trees, strict=True)))
    return min(node_distance, float(triangle_pairs_distance(*corners)[0].min(initial=node_distance)))


def overlap(points: list[np.ndarray], velocities: list[np.ndarray], triangles: list[np.ndarray]) -> Overlap | None:
    """Compute the overlap of two closed surfaces whose triangles face outwards; None if no point is inside the other.

    points : (n, 3) [m]; velocities : (n, 3) [m/s]; triangles : (m, 3) of each
    Signed distances are VTK's (``vtkImplicitPolyDataDistance``), and not those of trees or triangles that are judged.
    The velocities are those of the nodes nearest to the place.
    """
    inside_parts = [_inside(points[side], triangles[side], points[1 - side], triangles[1 - side]) for side in range(2)]
    places, outward, areas = (np.concatenate(parts) for parts in zip(*inside_parts, strict=True))
    # b's part moves out of a, so a moves the other way
    outward[len(inside_parts[0][0]) :] *= -1.0
    depths = np.linalg.norm(outward, axis=1)
    if not depths.any():
        return None
    weights = areas * depths
    place, pushed = weights @ places / weights.sum(), areas @ outward
    nearest = [int(np.linalg.norm(at - place, axis=1).argmin()) for at in points]
    relative = velocities[0][nearest[0]] - velocities[1][nearest[1]]
    return Overlap(place, pushed / np.linalg.norm(pushed), float(depths.max()), relative)


def _inside(
    points: np.ndarray, triangles: np.ndarray, others: np.ndarray, around: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Find the points of a surface that are inside another surface, nine to a triangle.

    points, triangles : of the surface; others, around : of the other one
    Returns the points (k, 3) [m], the vectors (k, 3) [m] to the nearest points of the other, and areas (k,) [m²].
    """
    from vtkmodules.vtkFiltersCore import vtkImplicitPolyDataDistance

    distance_to = vtkImplicitPolyDataDistance()
    distance_to.SetInput(polydata(others, around))
    corners = points[triangles]
    # no point of a triangle is farther from all of its nodes than this (Jung 1901)
    reach = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1) / np.sqrt(3.0)
    lowest, highest = others.min(axis=0) - reach.max(), others.max(axis=0) + reach.max()
    near = ((points >= lowest) & (points <= highest)).all(axis=1)
    signed_distance = np.full(len(points), np.inf)
    signed_distance[near] = [distance_to.EvaluateFunction(point) for point in points[near]]
    near_triangles = triangles[signed_distance[triangles].min(axis=1) < reach]
    shares = part_centres(3)
    centres = np.column_stack([1.0 - shares[:, 0] - shares[:, 1], shares])
    places = np.einsum("pc,tci->tpi", centres, points[near_triangles]).reshape(-1, 3)
    areas = np.linalg.norm(area_normals(points, near_triangles), axis=1) / 2 / len(centres)
    closest, outward, inside = [0.0, 0.0, 0.0], np.zeros_like(places), np.zeros(len(places), dtype=bool)
    for k, place in enumerate(places):
        if distance_to.EvaluateFunctionAndGetClosestPoint(place, closest) < 0.0:
            outward[k], inside[k] = closest - place, True
    return places[inside], outward[inside], np.repeat(areas, len(centres))[inside]


SPAN = 1e-4  # time over which velocities are differences of positions, over the scene's one second


class Frame(NamedTuple):
    """One frame of a scene with two bodies, and the exact answers that contacts are compared with.

    pairs : (k, 2) triangles that cross; distance : [m] of the bodies if none do; overlap : of the bodies if some do
    """

    points: list[np.ndarray]
    velocities: list[np.ndarray]
    pairs: np.ndarray
    distance: float
    overlap: Overlap | None


COLLISION_PRECISION = Table(
    "collision_precision",
    "The time and the errors of contacts from bounding trees that are stopped at a layer, and from whole trees.",
    """
    scene structure depths exact layer triangles: a structure, and whole or its last layer
    refit_ms contacts_ms frame_ms: median processor times [ms]
    tests contacts false_pairs missed_pairs: tests, contacts, and pairs reported wrongly or missed
    frames_apart false_frames: frames without contact, and those of them with a contact reported
    reported_m nearest_m: largest distance at which contact is reported, and least distance of bodies apart [m]
    place_error_m direction_error_deg depth_error_m velocity_error_m_s: mean errors where bodies overlap [m, °, m, m/s]
    response_error_m response_m: RMS error of depth times direction over all frames, and RMS of what it should be [m]
    frames threads: frames, and threads that worked
    """,
)


def measure(settings: Stopped, refinements: int, report: Callable) -> pd.DataFrame:
    """Measure the rows of collision_precision.csv: one for each scene, structure and layer, and one for whole trees.

    refinements, report : as of ``compare_trees.measure``
    Contacts are those of the leaves of stopped trees, and of triangles in whole trees. Errors are against ``overlap``.
    """
    rows = []
    kinds: list[tuple[str, tuple[int, int] | None]] = [("sphere", None), ("aabb", None)]
    kinds += [("composite", (upper, middle)) for upper, middle in settings.depths]
    for scene in (make(refinements) for make in (two_livers, instrument_press, instrument_approach, livers_apart)):
        course = _course(scene, settings.frames)
        for structure, layers_of_tree in kinds:
            for layer in [*settings.layers, None]:
                row = {"scene": scene.name, "structure": structure, "depths": "/".join(map(str, layers_of_tree or ()))}
                rows.append(row | _row(scene, course, structure, layers_of_tree, layer))
        report(scene.name)
    return pd.DataFrame(rows)


def _course(scene: Moving, frames: int) -> list[Frame]:
    """Compute the frames of a scene, evenly over its duration, with their exact answers."""
    trees, course = [Tree(at, cells, "sphere") for at, cells in zip(scene.at(0.0), scene.triangles, strict=True)], []
    for time in (np.arange(frames) + 0.5) / frames:
        points, neighbours = scene.at(time), zip(scene.at(time - SPAN), scene.at(time + SPAN), strict=True)
        velocities = [(after - before) / (2 * SPAN) for before, after in neighbours]
        pairs = crossing(points, scene.triangles)
        gap_m = 0.0 if len(pairs) else distance(points, trees)
        overlap_of_frame = overlap(points, velocities, scene.triangles) if len(pairs) else None
        course.append(Frame(points, velocities, pairs, gap_m, overlap_of_frame))
    return course


def _row(scene: Moving, course: list[Frame], structure: str, deep: tuple[int, int] | None, layer: int | None) -> dict:
    """Measure trees of a structure in a scene, stopped at ``layer``, or whole if it is None."""
    trees = RefittedTrees(structure, deep, scene.triangles, course[0].points, layer)
    find_contacts: Callable[..., Contacts] = triangle_contacts if layer is None else stopped_contacts
    find_contacts(*trees.trees, *course[0].velocities)  # compiles before anything is timed
    costs, judged = [], []
    for frame in course:
        update, _ = timed(trees.update, frame.points)
        search, contacts = timed(find_contacts, *trees.trees, *frame.velocities)
        costs.append((update, search, update + search, sum(contacts.tests), len(contacts.pairs)))
        judged.append(_judge(contacts, frame, _true_pairs(trees, frame)))
    names = ("refit_ms", "contacts_ms", "frame_ms", "tests", "contacts")
    return (
        {"exact": layer is None, "layer": layer, "triangles": sum(map(len, scene.triangles))}
        | dict(zip(names, np.median(costs, axis=0), strict=True))
        | _errors(pd.DataFrame(judged), course)
        | {"frames": len(course), "threads": 1}
    )


def _true_pairs(trees: RefittedTrees, frame: Frame) -> np.ndarray:
    """Return the pairs (k, 2) of leaves in which triangles cross, or of triangles where trees are whole."""
    stopped = [tree for tree in trees.trees if isinstance(tree, StoppedTree)]
    if not stopped:
        return frame.pairs
    leaves = [tree.leaf_of()[column] for tree, column in zip(stopped, frame.pairs.T, strict=True)]
    return np.unique(np.column_stack(leaves), axis=0)


def _judge(contacts: Contacts, frame: Frame, true: np.ndarray) -> dict[str, float]:
    """Compare the contacts of a frame with its exact answers; ``true`` : of ``_true_pairs``; lengths in m.

    The response is the largest depth times the direction of the contacts' mean, weighted with depths: a penalty force
    is proportional to it. It is zero without contacts, or where directions cancel.
    """
    direction_sum = contacts.depths @ contacts.directions
    norm = float(np.linalg.norm(direction_sum))
    direction = direction_sum / norm if norm > 0.0 else np.zeros(3)
    response = float(contacts.depths.max(initial=0.0)) * direction
    truth = frame.overlap
    true_response = truth.depth * truth.direction if truth else np.zeros(3)
    reported, crossing_ids = (pairs[:, 0].astype(np.int64) << 32 | pairs[:, 1] for pairs in (contacts.pairs, true))
    row = {
        "reported": len(reported) > 0,
        "false": len(np.setdiff1d(reported, crossing_ids)),
        "missed": len(np.setdiff1d(crossing_ids, reported)),
        "response": float(np.sum((response - true_response) ** 2)),
    }
    if not truth or not len(reported):
        return row
    weights = contacts.depths + np.finfo(float).tiny
    place, velocity = (weights @ part / weights.sum() for part in (contacts.places, contacts.velocities))
    cosine = float(np.clip(direction @ truth.direction, -1.0, 1.0))
    return row | {
        "place": float(np.linalg.norm(place - truth.place)),
        "angle": float(np.degrees(np.arccos(cosine))),
        "depth": abs(float(contacts.depths.max()) - truth.depth),
        "velocity": float(np.linalg.norm(velocity - truth.velocity)),
    }


def _errors(judged: pd.DataFrame, course: list[Frame]) -> dict[str, float]:
    """Summarise the comparisons of all frames in the columns of COLLISION_PRECISION; ``response`` is a square [m²]."""
    judged = judged.reindex(columns=["reported", "false", "missed", "response", "place", "angle", "depth", "velocity"])
    is_apart = np.array([not len(frame.pairs) for frame in course])
    gaps = np.array([frame.distance for frame in course])
    reported = judged["reported"].to_numpy(dtype=bool)
    true_depths = [frame.overlap.depth if frame.overlap else 0.0 for frame in course]
    return {
        "false_pairs": float(judged["false"].median()),
        "missed_pairs": int(judged["missed"].sum()),
        "frames_apart": int(is_apart.sum()),
        "false_frames": int((reported & is_apart).sum()),
        "reported_m": float(gaps[reported].max(initial=0.0)),
        "nearest_m": float(gaps[is_apart].min(initial=np.inf)) if is_apart.any() else 0.0,
        "place_error_m": judged["place"].mean(),
        "direction_error_deg": judged["angle"].mean(),
        "depth_error_m": judged["depth"].mean(),
        "velocity_error_m_s": judged["velocity"].mean(),
        "response_error_m": float(np.sqrt(judged["response"].mean())),
        "response_m": float(np.sqrt(np.mean(np.square(true_depths)))),
    }


TESTS, LOOPS = 200_000, 5
"""Tests in a timed loop, so many that it takes a millisecond, and number of loops, the fastest of which counts."""


def nanoseconds(a: Tree, b: Tree) -> float:
    """Return the processor time [ns] of a test of two volumes, in the fastest of LOOPS loops."""
    pairs = searched_pairs(a, b)
    repeats = max(1, TESTS // len(pairs))
    _overlaps(a, b, pairs)  # compiles
    return 1e6 * min(timed(_overlaps, a, b, pairs, repeats)[0] for _ in range(LOOPS)) / (repeats * len(pairs))


def searched_pairs(a: Tree, b: Tree) -> np.ndarray:
    """Return the pairs of nodes (k, 2) that a query tests: both roots, and all children of two that overlap."""
    tested = to_test = [(0, 0)]
    while to_test:
        overlapping = [pair for pair in to_test if _overlaps(a, b, np.array([pair], dtype=np.int64))]
        to_test = []
        for node_a, node_b in overlapping:
            child_a, child_b = int(a.nodes[node_a, CHILD]), int(b.nodes[node_b, CHILD])
            if child_a >= 0 or child_b >= 0:
                below_a = (child_a, child_a + 1) if child_a >= 0 else (node_a,)
                below_b = (child_b, child_b + 1) if child_b >= 0 else (node_b,)
                to_test += product(below_a, below_b)
        tested = tested + to_test
    return np.array(tested, dtype=np.int64)


def _overlaps(a: Tree, b: Tree, pairs: np.ndarray, times: int = 1) -> int:
    """Count the overlaps among pairs of nodes (k, 2), each of which is tested ``times`` times."""
    kinds = int(a.nodes[0, KIND]), int(b.nodes[0, KIND])
    return _count(*kinds, a.spheres, b.spheres, a.boxes, b.boxes, pairs, times)


@numba.njit(cache=True)
def _count(kind_a, kind_b, spheres_a, spheres_b, boxes_a, boxes_b, pairs, times):
    """Count the overlaps as ``_overlaps``; kinds are numbers, as an array of kinds takes 15 ns more a test."""
    overlapping, pair_count = 0, len(pairs)
    for k in range(times * pair_count):
        i = k % pair_count
        if volumes_overlap(kind_a, kind_b, spheres_a, spheres_b, boxes_a, boxes_b, pairs[i, 0], pairs[i, 1]):
            overlapping += 1
    return overlapping


GAP_TOLERANCE = 0.01  # relative
REPEATS = 5  # queries of one placement: a single one takes microseconds

COLLISION_APART = Table(
    "collision_apart",
    "The times and the tests with which each bounding structure shows that two bodies are apart.",
    """
    bodies structure depths rival triangles gap_m: bodies, a structure, triangles, and the gap [m]
    refit_ms query_ms frame_ms: median processor times [ms]
    node_tests triangle_tests roots_overlap: mean tests, and share of placements where the first test does not suffice
    extra_pairs placements threads: pairs reported wrongly, placements, and threads that worked
    test_ns: time of one test of volumes [ns]
    """,
)


def measure_apart(
    settings: Apart, refinements: int, depths: list[list[int]], seed: int, report: Callable
) -> pd.DataFrame:
    """Measure the rows of collision_apart.csv: one for each pair of bodies, gap and structure.

    refinements, depths : as of ``compare_trees.measure``; report : called with the name of each pair that is done
    Bodies are rotated at random and placed in a random direction from each other, and trees refitted to each placement.
    Times are medians over placements; a test of volumes is timed in a loop.
    """
    rows, gaps_m = [], settings.gaps_m
    for name, bodies in two_bodies(refinements).items():
        placed: dict[float, list[list[np.ndarray]]] = {gap: [] for gap in gaps_m}
        for number in range(settings.placements):
            for gap, points in _place(bodies, sorted(gaps_m), np.random.default_rng([seed, number])):
                placed[gap].append(points)
        triangles = [cells for _, cells in bodies]
        for (structure, layers, rival), make in contenders(depths, with_rivals=True).items():
            structure_run = make(triangles, [at for at, _ in bodies])
            costs = [(gap, *_cost(structure_run, placed[gap])) for gap in sorted(gaps_m, reverse=True)]
            test = nanoseconds(*structure_run.trees) if structure in PURE and not rival else np.nan  # at the least gap
            count = sum(map(len, triangles))
            rows += [(name, structure, layers, rival, count, *cost, test) for cost in reversed(costs)]
        report(name)
    return COLLISION_APART.frame(rows)


def _place(bodies: tuple, gaps_m: list[float], random: np.random.Generator) -> Iterator[tuple[float, list[np.ndarray]]]:
    """Rotate two bodies at random, and yield each gap, from the largest, with the points of both at that distance.

    The second body moves towards the first by its distance less the gap. That never passes the gap, as a distance
    shrinks by no more than the motion (conservative advancement, Mirtich 1996).
    """
    first, second = (turned(points, random) for points, _ in bodies)
    trees = [Tree(at, cells, "sphere") for at, (_, cells) in zip((first, second), bodies, strict=True)]
    direction = random.normal(size=3)
    direction /= np.linalg.norm(direction)
    # apart by the largest gap along the direction
    shifted = second + ((first @ direction).max() - (second @ direction).min() + gaps_m[-1]) * direction
    for gap in reversed(gaps_m):
        while (excess := distance([first, shifted], trees) - gap) > GAP_TOLERANCE * gap:
            shifted = shifted - excess * direction
        yield gap, [first, shifted]


def _cost(structure: Any, placed: list[list[np.ndarray]]) -> tuple[float, ...]:
    """Measure refit and query of a ``structure`` over placements of two bodies, in the order of COLLISION_APART.

    placed : the points (n, 3) [m] of both bodies, for each placement. Times are medians [ms]. The bodies are apart, so
        that each pair of triangles that is found is one too many; tests are counted of RefittedTrees, else NaN
    """
    costs, tests, root_overlaps, extra = [], [], 0, 0
    for points in placed:
        update, _ = timed(structure.update, points)
        queries = [timed(structure.query) for _ in range(REPEATS)]
        query = float(np.median([time for time, _ in queries]))
        costs.append((update, query, update + query))
        _, pairs = queries[0]
        extra += len(pairs)
        if isinstance(structure, RefittedTrees):
            tests.append(structure.counts)
            root_overlaps += len(overlapping_trees(structure.trees))
    update, query, frame = np.median(costs, axis=0)
    node_tests, triangle_tests = np.mean(tests, axis=0) if tests else (np.nan, np.nan)
    overlapping = root_overlaps / len(placed) if tests else np.nan
    refit = update if structure.refits else np.nan
    return refit, query, frame, node_tests, triangle_tests, overlapping, extra, len(placed), 1


def measure_collision_precision(
    say: Callable, stopped: Stopped, apart: Apart, depths: list[list[int]], refinements: int, seed: int
) -> dict[str, pd.DataFrame]:
    """Measure stopped trees and queries of bodies apart, for the rule of this name."""
    return {
        "collision_precision": measure(stopped, refinements, report=lambda scene: say(f"{scene} is done")),
        "collision_apart": measure_apart(apart, refinements, depths, seed, lambda pair: say(f"{pair} apart is done")),
    }
