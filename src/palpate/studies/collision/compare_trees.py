"""Cost of each bounding structure on deforming scenes, and its missed or false pairs of crossing triangles."""

import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from palpate.collision.triangles.brute_force import crossing
from palpate.studies.collision.deforming_surfaces import Moving, scenes
from palpate.studies.collision.rival_trees import installed

PURE = ("sphere", "aabb", "obb", "dop14", "dop18")
BLOCK = 10
"""Consecutive frames of one structure, so that its memory is in the cache, before the next structure runs."""
RIVALS_EVERY = 4
"""Rivals compute every fourth frame only, because building their trees takes most of the time."""
BUILDS = 3


class RefittedTrees:
    """Trees of palpate: built once, then refitted, and rebuilt when a tree reports that its quality has fallen.

    layer : the one at which the trees are stopped; None for whole trees
    """

    refits = True

    def __init__(
        self, structure: str, depths: tuple[int, int] | None, triangles: list, points: list, layer: int | None = None
    ):
        from palpate.collision.trees.tree import Tree
        from palpate.collision.trees.tree_query import StoppedTree

        more: dict[str, Any] = {"depths": depths} if depths else {}
        make = Tree if layer is None else partial(StoppedTree, layer=layer)
        self.trees = [make(at, cells, structure=structure, **more) for at, cells in zip(points, triangles, strict=True)]
        self.rebuilds = 0

    def update(self, points: list[np.ndarray]) -> None:
        """Refit the trees to the new ``points`` of each body, (n, 3) [m]; rebuild those that are worn."""
        for tree, moved in zip(self.trees, points, strict=True):
            tree.refit(moved)
            if tree.needs_rebuild:
                tree.rebuild(moved)
                self.rebuilds += 1

    def query(self) -> np.ndarray:
        """Return the crossing pairs, (k, 2) int64, and keep the numbers of tests in ``counts``."""
        from palpate.collision.trees.tree_query import crossing_pairs

        pairs, self.counts = crossing_pairs(*self.trees)
        return pairs


def contenders(depths: list[list[int]], with_rivals: bool) -> dict[tuple[str, str, bool], Callable]:
    """Return the constructors of all structures by structure, depths ("upper/middle") and whether it is a rival.

    depths : layers of spheres, and of spheres and AABBs, of every composite tree
    A constructor takes the triangles and points of the bodies.
    """
    found = {(name, "", False): partial(RefittedTrees, name, None) for name in PURE}
    found |= {("composite", f"{u}/{m}", False): partial(RefittedTrees, "composite", (u, m)) for u, m in depths}
    rivals = installed()[0] if with_rivals else {}
    return found | {(name, "", True): kind for name, kind in rivals.items()}


def measure(frames: int, refinements: int, depths: list[list[int]], seed: int, report: Callable) -> pd.DataFrame:
    """Measure the rows of collision.csv: one for each scene and structure.

    frames : of each scene; refinements : of the livers; report : called with the name of each scene that is done
    Times are medians over frames of processor time on one thread. build_ms and refit_ms cover all trees of the scene,
    refit_ms includes rebuilding worn trees (``rebuilds`` in all frames). frame_ms : query and refit together, or query
    and build where there is no refit. missed_pairs and extra_pairs : sums over all frames, against
    ``brute_force.crossing``. Rivals have no self-collision, so they are left out where a body collides with itself.
    """
    tables = []
    for scene in scenes(refinements, seed):
        tables.append(_scene_rows(scene, frames, contenders(depths, with_rivals=len(scene.triangles) == 2)))
        report(scene.name)
    return pd.DataFrame([row for rows in tables for row in rows])


def _scene_rows(scene: Moving, frames: int, makers: dict) -> list[dict]:
    start = scene.at(0.0)
    runs = {key: _Run(make, scene.triangles, start) for key, make in makers.items()}
    for first in range(0, frames, BLOCK):
        block = range(first, min(first + BLOCK, frames))
        points = {frame: scene.at(frame / frames) for frame in block}
        true = {frame: crossing(at, scene.triangles) for frame, at in points.items()}
        for (_, _, rival), run in runs.items():
            for frame in block:
                if not rival or frame % RIVALS_EVERY == 0:
                    run.frame(points[frame], true[frame])
    count = sum(map(len, scene.triangles))
    return [
        {"scene": scene.name, "structure": structure, "depths": depths, "rival": rival, "triangles": count} | run.row()
        for (structure, depths, rival), run in runs.items()
    ]


class _Run:
    """One contender in one scene: its times, and its missed and extra pairs."""

    def __init__(self, make: Callable, triangles: list[np.ndarray], start: list[np.ndarray]):
        self._count = len(triangles[-1])
        self._one = make(triangles, start)
        self._one.update(start)
        self._one.query()  # compiles before anything is timed
        self._built = [timed(make, triangles, start)[0] for _ in range(BUILDS)]
        self._frames: list[tuple[float, ...]] = []
        self._misjudged: list[tuple[int, int]] = []

    def frame(self, points: list[np.ndarray], true: np.ndarray) -> None:
        update, _ = timed(self._one.update, points)
        query, pairs = timed(self._one.query)
        counts = getattr(self._one, "counts", None)
        tests = (counts.node_tests, counts.triangle_tests) if counts else (np.nan, np.nan)
        self._frames.append((update, query, update + query, *tests, len(pairs)))
        found, wanted = (p[:, 0] * self._count + p[:, 1] for p in (pairs, true))
        self._misjudged.append((len(np.setdiff1d(wanted, found)), len(np.setdiff1d(found, wanted))))

    def row(self) -> dict:
        update, query, whole, nodes, tests, pairs = np.median(self._frames, axis=0)
        missed, extra = np.sum(self._misjudged, axis=0)
        refits = self._one.refits
        return {
            "build_ms": float(np.median(self._built)) if refits else update,
            "refit_ms": update if refits else np.nan,
            "query_ms": query,
            "frame_ms": whole,
            "node_tests": nodes,
            "triangle_tests": tests,
            "pairs": pairs,
            "missed_pairs": missed,
            "extra_pairs": extra,
            "rebuilds": getattr(self._one, "rebuilds", 0),
            "frames": len(self._frames),
            "threads": 1,
        }


def timed(call: Callable, *given: Any) -> tuple[float, Any]:
    """Time a call in milliseconds of this thread's processor time, without other processes; return time and result."""
    start = time.thread_time()
    result = call(*given)
    return 1e3 * (time.thread_time() - start), result
