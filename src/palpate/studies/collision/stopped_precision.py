"""Error and time of contacts from trees that are stopped at a layer: paper 3's precision for time."""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np
import pandas as pd

from palpate.collision.contact_points import ContactPoints, stopped_contacts, triangle_contacts
from palpate.collision.trees.tree import Tree
from palpate.collision.trees.tree_query import StoppedTree
from palpate.collision.triangles.brute_force import crossing
from palpate.studies.collision.compare_trees import RefittedTrees, timed
from palpate.studies.collision.deforming_surfaces import Moving, instrument_press, two_livers
from palpate.studies.collision.separated_surfaces import instrument_approach, livers_apart
from palpate.studies.collision.surface_distance import Overlap, distance, overlap

SPAN = 1e-4
"""Part of a scene over which velocities are differences of positions; a scene lasts one second."""


class Frame(NamedTuple):
    """One frame of a scene and the truth about it.

    pairs : (k, 2) triangles that cross; distance : [m] of bodies that do not; overlap : of bodies that do
    """

    points: list[np.ndarray]
    velocities: list[np.ndarray]
    pairs: np.ndarray
    distance: float
    overlap: Overlap | None


def measure(
    frames: int, refinements: int, depths: list[list[int]], layers: list[int], report: Callable
) -> pd.DataFrame:
    """Measure the rows of collision_precision.csv: one for each scene, structure and layer, and one for whole trees.

    frames : of each scene; refinements : of the livers; depths : of composite trees; layers : at which trees stop
    report : called with the name of each scene that is done
    Times are medians over frames of processor time on one thread; ``frame_ms`` is refit and contacts together. Whole
    trees test triangles (``exact``, without a layer). Errors are means over the frames in which bodies overlap, against
    ``surface_distance.overlap``; that of the response is the root mean square over all frames.
    """
    rows = []
    for scene in (make(refinements) for make in (two_livers, instrument_press, instrument_approach, livers_apart)):
        course = _course(scene, frames)
        kinds: list[tuple[str, tuple[int, int] | None]] = [("sphere", None), ("aabb", None)]
        for structure, deep in kinds + [("composite", (upper, middle)) for upper, middle in depths]:
            for layer in [*layers, None]:
                row = {"scene": scene.name, "structure": structure, "depths": "/".join(map(str, deep or ()))}
                rows.append(row | _row(scene, course, structure, deep, layer))
        report(scene.name)
    return pd.DataFrame(rows)


def _course(scene: Moving, frames: int) -> list[Frame]:
    """Find the truth about each frame."""
    spheres, found = [Tree(at, cells, "sphere") for at, cells in zip(scene.at(0.0), scene.triangles, strict=True)], []
    for time in (np.arange(frames) + 0.5) / frames:
        points = scene.at(time)
        velocities = [
            (after - before) / (2 * SPAN)
            for before, after in zip(scene.at(time - SPAN), scene.at(time + SPAN), strict=True)
        ]
        pairs = crossing(points, scene.triangles)
        if len(pairs):
            found.append(Frame(points, velocities, pairs, 0.0, overlap(points, velocities, scene.triangles)))
        else:
            found.append(Frame(points, velocities, pairs, distance(points, spheres), None))
    return found


def _row(scene: Moving, course: list[Frame], structure: str, deep: tuple[int, int] | None, layer: int | None) -> dict:
    trees = RefittedTrees(structure, deep, scene.triangles, course[0].points, layer)
    find: Callable[..., ContactPoints] = partial(triangle_contacts, outward=True) if layer is None else stopped_contacts
    find(*trees.trees, *course[0].velocities)  # compiles before anything is timed
    costs, judged = [], []
    for frame in course:
        update, _ = timed(trees.update, frame.points)
        search, contacts = timed(find, *trees.trees, *frame.velocities)
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
    """Return the pairs (k, 2) of leaves, or of whole trees of triangles, in which triangles cross."""
    stopped = [tree for tree in trees.trees if isinstance(tree, StoppedTree)]
    if not stopped:
        return frame.pairs
    leaves = [tree.leaf_of()[column] for tree, column in zip(stopped, frame.pairs.T, strict=True)]
    return np.unique(np.column_stack(leaves), axis=0)


def response(contacts: ContactPoints) -> tuple[np.ndarray, np.ndarray]:
    """Return the direction (3,) of the contacts' mean, weighted with depths, and it times the largest depth [m].

    It is what a penalty force is proportional to; both are zero without contacts, or where they cancel.
    """
    pushed = contacts.depths @ contacts.directions
    length = float(np.linalg.norm(pushed))
    direction = pushed / length if length > 0.0 else np.zeros(3)
    return direction, float(contacts.depths.max(initial=0.0)) * direction


def _judge(contacts: ContactPoints, frame: Frame, true: np.ndarray) -> dict[str, float]:
    """Compare the contacts of a frame with the truth; lengths in m."""
    direction, moved = response(contacts)
    truth = frame.overlap
    wanted = truth.depth * truth.direction if truth else np.zeros(3)
    reported, crossed = (pairs[:, 0].astype(np.int64) << 32 | pairs[:, 1] for pairs in (contacts.pairs, true))
    found = {
        "reported": len(reported) > 0,
        "false": len(np.setdiff1d(reported, crossed)),
        "missed": len(np.setdiff1d(crossed, reported)),
        "response": float(np.sum((moved - wanted) ** 2)),
    }
    if not truth or not len(reported):
        return found
    weights = contacts.depths + np.finfo(float).tiny
    place, velocity = (weights @ part / weights.sum() for part in (contacts.places, contacts.velocities))
    cosine = float(np.clip(direction @ truth.direction, -1.0, 1.0))
    return found | {
        "place": float(np.linalg.norm(place - truth.place)),
        "angle": float(np.degrees(np.arccos(cosine))),
        "depth": abs(float(contacts.depths.max()) - truth.depth),
        "velocity": float(np.linalg.norm(velocity - truth.velocity)),
    }


def _errors(judged: pd.DataFrame, course: list[Frame]) -> dict[str, float]:
    """Gather what a row of the table says of all frames."""
    judged = judged.reindex(columns=["reported", "false", "missed", "response", "place", "angle", "depth", "velocity"])
    apart = np.array([not len(frame.pairs) for frame in course])
    away = np.array([frame.distance for frame in course])
    reported = judged["reported"].to_numpy(dtype=bool)
    wanted = [frame.overlap.depth if frame.overlap else 0.0 for frame in course]
    return {
        "false_pairs": float(judged["false"].median()),
        "missed_pairs": int(judged["missed"].sum()),
        "frames_apart": int(apart.sum()),
        "false_frames": int((reported & apart).sum()),
        "reported_m": float(away[reported].max(initial=0.0)),
        "nearest_m": float(away[apart].min(initial=np.inf)) if apart.any() else 0.0,
        "place_error_m": judged["place"].mean(),
        "direction_error_deg": judged["angle"].mean(),
        "depth_error_m": judged["depth"].mean(),
        "velocity_error_m_s": judged["velocity"].mean(),
        "response_error_m": float(np.sqrt(judged["response"].mean())),
        "response_m": float(np.sqrt(np.mean(np.square(wanted)))),
    }
