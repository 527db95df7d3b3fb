"""Cost of bounding structures of palpate and of other libraries on deforming scenes, and over the triangles."""

import time
from collections.abc import Callable
from functools import partial
from importlib.util import find_spec
from typing import Any

import numpy as np
import pandas as pd

from palpate.collision.trees.tree_query import RefittedTrees
from palpate.studies.brute_force import crossing
from palpate.studies.prescribed_motions import Moving, crossing_waves, scenes
from palpate.table_declaration import Table

EVERY = 10**9  # upper limit of pairs, never reached: by default both packages stop after a few pairs


def installed() -> tuple[dict[str, type], list[str]]:
    """Return the rival libraries' trees that can be imported, by structure, and the packages that cannot be."""
    rivals: dict[str, tuple[str, type]] = {
        "obb_rss_fcl": ("fcl", Fcl),
        "obb_coal": ("coal", Coal),
        "obb_coal_refit": ("coal", CoalRefit),
    }
    missing = [package for package in ("fcl", "coal") if find_spec(package) is None]
    return {name: make for name, (package, make) in rivals.items() if package not in missing}, missing


class Fcl:
    """Trees of python-fcl: OBB-RSS, without refit, rebuilt in every frame.

    As in ``Coal``, contact points (``enable_contact``) are not computed: they cost time and are not needed here.
    """

    refits = False

    def __init__(self, triangles: list[np.ndarray], points: list[np.ndarray]):
        import fcl

        self._fcl, self._triangles = fcl, triangles
        self.update(points)

    def update(self, points: list[np.ndarray]) -> None:
        """Build the trees of both bodies at their new ``points``, (n, 3) [m] each."""
        self._objects = []
        for moved, triangles in zip(points, self._triangles, strict=True):
            model = self._fcl.BVHModel()
            model.beginModel(len(triangles), len(moved))
            model.addSubModel(moved, triangles)
            model.endModel()
            self._objects.append(self._fcl.CollisionObject(model, self._fcl.Transform()))

    def query(self) -> np.ndarray:
        """Return the crossing pairs, (k, 2) int64, unsorted."""
        request, result = self._fcl.CollisionRequest(num_max_contacts=EVERY), self._fcl.CollisionResult()
        self._fcl.collide(*self._objects, request, result)
        return np.array([(contact.b1, contact.b2) for contact in result.contacts], dtype=np.int64).reshape(-1, 2)


class Coal:
    """Trees of coal: OBB (its OBB-RSS take longer to build and to query), rebuilt in every frame."""

    refits = False

    def __init__(self, triangles: list[np.ndarray], points: list[np.ndarray]):
        import coal

        self._coal, self._triangles, self._here = coal, triangles, coal.Transform3s()
        self._asked = coal.CollisionRequest()
        self._asked.num_max_contacts, self._asked.enable_contact = EVERY, False
        self._found = coal.CollisionResult()
        Coal.update(self, points)  # a build, also of those that are refitted

    def update(self, points: list[np.ndarray]) -> None:
        self._models = []
        for moved, triangles in zip(points, self._triangles, strict=True):
            model = self._coal.BVHModelOBB()
            model.beginModel(len(triangles), len(moved))
            model.addVertices(moved)
            model.addTriangles(triangles)
            model.endModel()
            self._models.append(model)

    def query(self) -> np.ndarray:
        self._found.clear()
        first_body, second_body = self._models
        self._coal.collide(first_body, self._here, second_body, self._here, self._asked, self._found)
        pairs = [(contact.b1, contact.b2) for contact in self._found.getContacts()]
        return np.array(pairs, dtype=np.int64).reshape(-1, 2)


class CoalRefit(Coal):
    """Trees of coal, refitted bottom-up, which takes a fifth of the time of its top-down refit."""

    refits = True

    def __init__(self, triangles: list[np.ndarray], points: list[np.ndarray]):
        super().__init__(triangles, points)
        # passing points one by one costs more than the refit, so the same points are passed in every frame
        # and the new ones are written into the model's own array
        self._filled = [self._coal.StdVec_Vec3s() for _ in points]
        for filled, moved in zip(self._filled, points, strict=True):
            filled.extend(list(moved))

    def update(self, points: list[np.ndarray]) -> None:
        for model, filled, moved in zip(self._models, self._filled, points, strict=True):
            model.beginReplaceModel()
            model.replaceSubModel(filled)
            model.vertices()[:] = moved
            model.endReplaceModel(True, True)


PURE = ("sphere", "aabb", "obb", "dop14", "dop18")
BLOCK = 10  # consecutive frames of one structure, so that its memory is in the cache, before the next structure runs
RIVALS_EVERY = 4  # rivals compute every fourth frame only, because building their trees takes most of the time


def contenders(depths: list[list[int]], with_rivals: bool) -> dict[tuple[str, str, bool], Callable]:
    """Return the constructors of all structures, by structure, depths ("upper/middle") and whether it is a rival.

    depths : layers of spheres, and of spheres and AABBs, of every composite tree
    A constructor takes the triangles and points of the bodies.
    """
    structures = {(name, "", False): partial(RefittedTrees, name, None) for name in PURE}
    structures |= {("composite", f"{u}/{m}", False): partial(RefittedTrees, "composite", (u, m)) for u, m in depths}
    rivals = installed()[0] if with_rivals else {}
    return structures | {(name, "", True): kind for name, kind in rivals.items()}


COLLISION = Table(
    "collision",
    "The times, the tests, and the missed and extra pairs of each bounding structure in each scene.",
    """
    scene structure depths rival: a scene; a structure, layers of a composite tree, and whether it is of another library
    triangles: of all bodies
    build_ms refit_ms query_ms frame_ms: median processor times; a frame is refit and query, or build and query [ms]
    node_tests triangle_tests pairs: tests of volumes and of triangles, and crossing pairs found
    missed_pairs extra_pairs: over all frames, against brute force
    rebuilds frames threads: rebuilds in all frames, frames, and threads that worked
    """,
)


def measure(frames: int, refinements: int, depths: list[list[int]], seed: int, report: Callable) -> pd.DataFrame:
    """Measure the rows of collision.csv: one for each scene and structure.

    frames : of each scene; refinements : of the livers; report : called with the name of each scene that is done
    Times are those of all trees of a scene; a refit includes rebuilding trees that have become loose. Rivals are left
    out of scenes in which a body collides with itself, which they cannot find.
    """
    rows = []
    for scene in scenes(refinements, seed):
        rows += _scene_rows(scene, frames, contenders(depths, with_rivals=len(scene.triangles) == 2))
        report(scene.name)
    return COLLISION.frame(rows)


def _scene_rows(scene: Moving, frames: int, makers: dict) -> list[tuple]:
    """Measure all structures ``makers`` in one scene, in turns of BLOCK frames."""
    start = scene.at(0.0)
    runs = {key: _Run(make, scene.triangles, start) for key, make in makers.items()}
    for first_frame in range(0, frames, BLOCK):
        block = range(first_frame, min(first_frame + BLOCK, frames))
        points = {frame: scene.at(frame / frames) for frame in block}
        crossing_pairs = {frame: crossing(frame_points, scene.triangles) for frame, frame_points in points.items()}
        for (_, _, rival), run in runs.items():
            for frame in block:
                if not rival or frame % RIVALS_EVERY == 0:
                    run.frame(points[frame], crossing_pairs[frame])
    count = sum(map(len, scene.triangles))
    return [(scene.name, *key, count, *run.row()) for key, run in runs.items()]


class _Run:
    """The measurement of one structure in one scene: its times, and its missed and extra pairs."""

    def __init__(self, make: Callable, triangles: list[np.ndarray], start: list[np.ndarray]):
        self._count = len(triangles[-1])
        self._one = make(triangles, start)
        self._one.update(start)
        self._one.query()  # compiles before anything is timed
        self._built = [timed(make, triangles, start)[0] for _ in range(3)]
        self._frames: list[tuple[float, ...]] = []
        self._misjudged: list[tuple[int, int]] = []

    def frame(self, points: list[np.ndarray], true: np.ndarray) -> None:
        """Measure one frame: positions ``points`` of the bodies, and the pairs ``true`` (k, 2) that cross."""
        update, _ = timed(self._one.update, points)
        query, pairs = timed(self._one.query)
        counts = getattr(self._one, "counts", None)
        tests = (counts.node_tests, counts.triangle_tests) if counts else (np.nan, np.nan)
        self._frames.append((update, query, update + query, *tests, len(pairs)))
        reported, expected = (p[:, 0] * self._count + p[:, 1] for p in (pairs, true))
        self._misjudged.append((len(np.setdiff1d(expected, reported)), len(np.setdiff1d(reported, expected))))

    def row(self) -> tuple:
        """Return what COLLISION has after the triangles."""
        build, (refit, *others) = float(np.median(self._built)), np.median(self._frames, axis=0)
        if not self._one.refits:  # each of its frames is a build
            build, refit = refit, np.nan
        misjudged = np.sum(self._misjudged, axis=0)
        return build, refit, *others, *misjudged, getattr(self._one, "rebuilds", 0), len(self._frames), 1


def timed(call: Callable, *given: Any) -> tuple[float, Any]:
    """Time a call in milliseconds of this thread's processor time, without other processes; return time and result."""
    start = time.thread_time()
    result = call(*given)
    return 1e3 * (time.thread_time() - start), result


STAGES = ("build_ms", "refit_ms", "query_ms")


def exponents(table: pd.DataFrame) -> pd.DataFrame:
    """Fit the exponent of the triangles in each time of STAGES; returns structure, depths, rival and STAGES."""
    large = table[table["triangles"] >= 5000]  # with fewer the cost of calling compiled functions matters
    rows = []
    for (structure, depths, rival), group in large.groupby(["structure", "depths", "rival"], sort=False, dropna=False):
        row = {"structure": structure, "depths": depths, "rival": rival}
        if len(group) > 1:
            count = np.log(group["triangles"])
            row |= {stage: np.polyfit(count, np.log(group[stage]), 1)[0] for stage in STAGES}
        rows.append(row)
    return pd.DataFrame(rows).reindex(columns=["structure", "depths", "rival", *STAGES])


COLLISION_SCALING = Table(
    "collision_scaling",
    "The times of each bounding structure over the number of triangles.",
    """
    structure depths rival triangles: a structure, as in collision.csv, and triangles of both sheets
    build_ms refit_ms query_ms: median processor times of both trees [ms]
    pairs threads: crossing pairs, and threads that worked
    """,
)


def measure_growth(triangles: list[int], depths: list[list[int]], report: Callable) -> pd.DataFrame:
    """Measure the rows of collision_scaling.csv on two crossing sheets, over three frames for each size.

    triangles : approximate numbers of triangles of both sheets together; report : called with each that is done
    """
    rows = []
    smallest = crossing_waves(0)
    for make in contenders(depths, with_rivals=True).values():
        _times(make, smallest.triangles, [smallest.at(0.0)])  # compiles the kernels
    for number in triangles:
        scene = crossing_waves(number)
        points = [scene.at(0.002 * frame) for frame in range(3)]
        count = sum(map(len, scene.triangles))
        for key, make in contenders(depths, with_rivals=True).items():
            rows.append((*key, count, *_times(make, scene.triangles, points), 1))
        report(number)
    return COLLISION_SCALING.frame(rows)


def _times(make: Callable, triangles: list[np.ndarray], points: list[list[np.ndarray]]) -> tuple[float, ...]:
    """Measure the time of a build, and the medians of refit, query and pairs over frames of ``points``."""
    built, tree_pair = timed(make, triangles, points[0])
    measured = []
    # without a refit every frame is a build, which the first call has timed
    for frame_points in points:
        update = timed(tree_pair.update, frame_points)[0] if tree_pair.refits else np.nan
        query, pairs = timed(tree_pair.query)
        measured.append((update, query, len(pairs)))
    return built, *np.median(measured, axis=0)


def measure_collision(
    say: Callable, frames: int, refinements: int, depths: list[list[int]], triangles: list[int], seed: int
) -> dict[str, pd.DataFrame]:
    """Compare the structures in motion, and their growth with the triangles, for the rule of this name."""
    for package in installed()[1]:
        say(f"{package} is not installed, so its rows are left out")
    return {
        "collision": measure(frames, refinements, depths, seed, report=lambda scene: say(f"{scene} is done")),
        "scaling": measure_growth(triangles, depths[:1], lambda number: say(f"{number} triangles are done")),
    }
