"""Cost of showing that two bodies are apart, over the gap between them, and of one test of two bounding volumes."""

from collections.abc import Callable, Iterator
from itertools import product
from typing import Any

import numba
import numpy as np
import pandas as pd

from palpate.collision.prescribed_motions import turned, two_bodies
from palpate.collision.trees.build_tree import CHILD, KIND
from palpate.collision.trees.tree import Tree
from palpate.collision.trees.tree_query import overlapping_trees
from palpate.collision.trees.volumes import volumes_overlap
from palpate.studies.collision import stopped_precision
from palpate.studies.collision.compare_trees import PURE, RefittedTrees, contenders, timed
from palpate.studies.collision.stopped_precision import distance
from palpate.table_declaration import Table

TESTS, LOOPS = 200_000, 5
"""Tests in a loop that is timed, so that it takes a millisecond or more, and loops of which the fastest counts."""


def nanoseconds(a: Tree, b: Tree) -> float:
    """Return the least processor time of a test [ns] over LOOPS loops through ``searched_pairs``."""
    pairs = searched_pairs(a, b)
    many = max(1, TESTS // len(pairs))
    _overlaps(a, b, pairs)  # compiles
    return 1e6 * min(timed(_overlaps, a, b, pairs, many)[0] for _ in range(LOOPS)) / (many * len(pairs))


def searched_pairs(a: Tree, b: Tree) -> np.ndarray:
    """Return the pairs of nodes (k, 2) that a descent from both roots tests: where two overlap, all their children."""
    found = front = [(0, 0)]
    while front:
        overlapping = [pair for pair in front if _overlaps(a, b, np.array([pair], dtype=np.int64))]
        front = []
        for node_a, node_b in overlapping:
            child_a, child_b = int(a.nodes[node_a, CHILD]), int(b.nodes[node_b, CHILD])
            if child_a >= 0 or child_b >= 0:
                below_a = (child_a, child_a + 1) if child_a >= 0 else (node_a,)
                below_b = (child_b, child_b + 1) if child_b >= 0 else (node_b,)
                front += product(below_a, below_b)
        found = found + front
    return np.array(found, dtype=np.int64)


def _overlaps(a: Tree, b: Tree, pairs: np.ndarray, times: int = 1) -> int:
    """Count the overlaps among pairs of nodes (k, 2), which are tested several times over."""
    kinds = int(a.nodes[0, KIND]), int(b.nodes[0, KIND])
    return _count(*kinds, a.spheres, b.spheres, a.boxes, b.boxes, pairs, times)


@numba.njit(cache=True)
def _count(kind_a, kind_b, spheres_a, spheres_b, boxes_a, boxes_b, pairs, times):
    """Count the overlaps; one loop with one kind, as two or an array of kinds takes 15 ns more a test."""
    found, many = 0, len(pairs)
    for k in range(times * many):
        i = k % many
        if volumes_overlap(kind_a, kind_b, spheres_a, spheres_b, boxes_a, boxes_b, pairs[i, 0], pairs[i, 1]):
            found += 1
    return found


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


def measure(
    gaps_m: list[float], placements: int, refinements: int, depths: list[list[int]], seed: int, report: Callable
) -> pd.DataFrame:
    """Measure the rows of collision_apart.csv: one for each pair of bodies, gap and structure.

    gaps_m : distances of the surfaces; placements : how often both bodies are turned at random and placed in a random
    direction from each other; report : called with the name of each pair that is done
    Times are medians over placements; tests of volumes are timed in a loop. Trees are refitted to each placement.
    """
    rows = []
    for name, bodies in two_bodies(refinements).items():
        placed: dict[float, list[list[np.ndarray]]] = {gap: [] for gap in gaps_m}
        for number in range(placements):
            for gap, points in _place(bodies, sorted(gaps_m), np.random.default_rng([seed, number])):
                placed[gap].append(points)
        triangles = [cells for _, cells in bodies]
        for (structure, deep, rival), make in contenders(depths, with_rivals=True).items():
            one = make(triangles, [at for at, _ in bodies])
            row = {"bodies": name, "structure": structure, "depths": deep, "rival": rival}
            row |= {"triangles": sum(map(len, triangles))}
            rows += [row | {"gap_m": gap} | _cost(one, placed[gap]) for gap in sorted(gaps_m, reverse=True)]
            test = nanoseconds(*one.trees) if structure in PURE and not rival else np.nan  # at the least gap
            rows[-len(gaps_m) :] = [each | {"test_ns": test} for each in reversed(rows[-len(gaps_m) :])]
        report(name)
    return pd.DataFrame(rows)


def _place(bodies: tuple, gaps_m: list[float], random: np.random.Generator) -> Iterator[tuple[float, list[np.ndarray]]]:
    """Yield each gap, from the largest, and the points of both bodies at that distance.

    The second body moves towards the first by what is too far: so it never passes the gap, as no distance shrinks by
    more than the motion (conservative advancement, Mirtich 1996).
    """
    here, there = (turned(points, random) for points, _ in bodies)
    trees = [Tree(at, cells, "sphere") for at, (_, cells) in zip((here, there), bodies, strict=True)]
    way = random.normal(size=3)
    way /= np.linalg.norm(way)
    # between two planes across the way
    moved = there + ((here @ way).max() - (there @ way).min() + gaps_m[-1]) * way
    for gap in reversed(gaps_m):
        while (left := distance([here, moved], trees) - gap) > GAP_TOLERANCE * gap:
            moved = moved - left * way
        yield gap, [here, moved]


def _cost(one: Any, placed: list[list[np.ndarray]]) -> dict[str, float]:
    costs, tests, roots, found = [], [], 0, 0
    for points in placed:
        update, _ = timed(one.update, points)
        queries = [timed(one.query) for _ in range(REPEATS)]
        query = float(np.median([time for time, _ in queries]))
        costs.append((update, query, update + query))
        found += len(queries[0][1])
        if isinstance(one, RefittedTrees):
            tests.append(one.counts)
            roots += len(overlapping_trees(one.trees))
    update, query, whole = np.median(costs, axis=0)
    nodes, triangles = np.mean(tests, axis=0) if tests else (np.nan, np.nan)
    times = {"refit_ms": update if one.refits else np.nan, "query_ms": query, "frame_ms": whole}
    counts = {"node_tests": nodes, "triangle_tests": triangles}
    counts["roots_overlap"] = roots / len(placed) if tests else np.nan
    return times | counts | {"extra_pairs": found, "placements": len(placed), "threads": 1}


def measure_collision_precision(params, say):
    """Measure stopped trees and bodies apart, for the rule of that name."""
    size, more = {"refinements": params.refinements}, {"depths": params.depths, "seed": params.seed}
    stopped = stopped_precision.measure(**params.stopped, **size, report=lambda scene: say(f"{scene} is done"))
    apart = measure(**params.apart, **size, **more, report=lambda pair: say(f"{pair} apart is done"))
    return {"precision": stopped, "apart": apart}
