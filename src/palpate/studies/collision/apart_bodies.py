"""Cost of showing that two bodies are apart, over the gap between them."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pandas as pd

from palpate.collision.trees.tree import Tree
from palpate.collision.trees.tree_query import overlapping_trees
from palpate.studies.collision.compare_trees import PURE, RefittedTrees, contenders, timed
from palpate.studies.collision.separated_surfaces import turned, two_bodies
from palpate.studies.collision.surface_distance import distance
from palpate.studies.collision.volume_tests import nanoseconds

NEAR = 0.01
"""Relative error of a gap."""
REPEATS = 5
"""Queries of one placement: a single one takes microseconds."""


def measure(
    gaps_m: list[float], placements: int, refinements: int, depths: list[list[int]], seed: int, report: Callable
) -> pd.DataFrame:
    """Measure the rows of collision_apart.csv: one for each pair of bodies, gap and structure.

    gaps_m : distances of the surfaces; placements : how often both bodies are turned at random and placed in a random
    direction from each other; refinements : of the liver; depths : of composite trees; report : called with the name
    of each pair that is done
    Times are medians over placements of processor time on one thread; counts of tests are means, and ``roots_overlap``
    is the share of placements in which the first test does not suffice; ``test_ns`` is the time of a test of volumes of
    one kind in a loop of nothing else, at the least gap. Trees are refitted to each placement.
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
        while (left := distance([here, moved], trees) - gap) > NEAR * gap:
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
    return {
        "refit_ms": update if one.refits else np.nan,
        "query_ms": query,
        "frame_ms": whole,
        "node_tests": nodes,
        "triangle_tests": triangles,
        "roots_overlap": roots / len(placed) if tests else np.nan,
        "extra_pairs": found,
        "placements": len(placed),
        "threads": 1,
    }
