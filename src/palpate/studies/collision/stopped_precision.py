"""Error and time of contacts from trees that are stopped at a layer: paper 3's precision for time."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.spatial import KDTree

from palpate.bodies.surfaces.remesh import area_normals
from palpate.bodies.surfaces.triangles import polydata
from palpate.collision.contact_points import ContactPoints, stopped_contacts, triangle_contacts
from palpate.collision.prescribed_motions import Moving, instrument_approach, instrument_press, livers_apart, two_livers
from palpate.collision.trees.tree import Tree
from palpate.collision.trees.tree_query import StoppedTree, candidates
from palpate.collision.triangles.brute_force import crossing
from palpate.collision.triangles.distance import triangle_pairs_distance
from palpate.studies.collision.compare_trees import RefittedTrees, timed
from palpate.table_declaration import Table


class Overlap(NamedTuple):
    """Overlap of a body a with a body b.

    place : (3,) [m] and direction : (3,), in which a has to move: means over the surface of each inside the other,
    weighted with the depth; depth : [m] the largest; velocity : (3,) [m/s] of a relative to b at the place
    """

    place: np.ndarray
    direction: np.ndarray
    depth: float
    velocity: np.ndarray


def distance(points: list[np.ndarray], trees: list[Tree]) -> float:
    """Compute the distance [m] of two surfaces; 0 if they cross.

    points : (n, 3) [m] of each; trees : of spheres, over the triangles of each, refitted here
    """
    nearest = float(KDTree(points[0]).query(points[1])[0].min())
    for tree, moved in zip(trees, points, strict=True):
        tree.refit(moved, margin=0.5 * nearest * (1.0 + 1e-9))
    pairs, _ = candidates(*trees)
    corners = (at[tree.triangles[pairs[:, side]]] for side, (at, tree) in enumerate(zip(points, trees, strict=True)))
    return min(nearest, float(triangle_pairs_distance(*corners)[0].min(initial=nearest)))


def overlap(points: list[np.ndarray], velocities: list[np.ndarray], triangles: list[np.ndarray]) -> Overlap | None:
    """Compute the overlap of two closed surfaces whose triangles face outwards; None if no point is inside the other.

    points : (n, 3) [m]; velocities : (n, 3) [m/s]; triangles : (m, 3) of each
    Signed distances are VTK's (``vtkImplicitPolyDataDistance``), and not those of trees or triangles that are judged.
    The velocities are those of the nodes nearest to the place.
    """
    found = [_inside(points[side], triangles[side], points[1 - side], triangles[1 - side]) for side in range(2)]
    places, ways, areas = (np.concatenate(parts) for parts in zip(*found, strict=True))
    # b's part moves out of a, so a moves the other way
    ways[len(found[0][0]) :] *= -1.0
    depths = np.linalg.norm(ways, axis=1)
    if not depths.any():
        return None
    weights = areas * depths
    place, pushed = weights @ places / weights.sum(), areas @ ways
    nearest = [int(np.linalg.norm(at - place, axis=1).argmin()) for at in points]
    moving = velocities[0][nearest[0]] - velocities[1][nearest[1]]
    return Overlap(place, pushed / np.linalg.norm(pushed), float(depths.max()), moving)


def _inside(
    points: np.ndarray, triangles: np.ndarray, others: np.ndarray, around: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Find points of a surface inside another: (k, 3) [m], their shortest way out (k, 3) [m], and areas (k,) [m²]."""
    from vtkmodules.vtkFiltersCore import vtkImplicitPolyDataDistance

    measure = vtkImplicitPolyDataDistance()
    measure.SetInput(polydata(others, around))
    corners = points[triangles]
    # no point of a triangle is farther from all of its nodes than this (Jung 1901)
    reach = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1) / np.sqrt(3.0)
    low, high = others.min(axis=0) - reach.max(), others.max(axis=0) + reach.max()
    near = ((points >= low) & (points <= high)).all(axis=1)
    away = np.full(len(points), np.inf)
    away[near] = [measure.EvaluateFunction(point) for point in points[near]]
    chosen = triangles[away[triangles].min(axis=1) < reach]
    centres = _centres(3)  # nine points of a triangle
    places = np.einsum("pc,tci->tpi", centres, points[chosen]).reshape(-1, 3)
    areas = np.linalg.norm(area_normals(points, chosen), axis=1) / 2 / len(centres)
    closest, ways, kept = [0.0, 0.0, 0.0], np.zeros_like(places), np.zeros(len(places), dtype=bool)
    for k, place in enumerate(places):
        if measure.EvaluateFunctionAndGetClosestPoint(place, closest) < 0.0:
            ways[k], kept[k] = closest - place, True
    return places[kept], ways[kept], np.repeat(areas, len(centres))[kept]


def _centres(parts: int) -> np.ndarray:
    """Return the barycentric coordinates (parts², 3) of the centres of equal parts of a triangle."""
    u, v = (x.ravel() for x in np.meshgrid(np.arange(parts), np.arange(parts)))
    first, second = u + v < parts, u + v < parts - 1
    across = np.concatenate([u[first] + 1 / 3, u[second] + 2 / 3]) / parts
    along = np.concatenate([v[first] + 1 / 3, v[second] + 2 / 3]) / parts
    return np.column_stack([1.0 - across - along, across, along])


SPAN = 1e-4  # of a scene, over which velocities are differences of positions; a scene lasts one second


class Frame(NamedTuple):
    """One frame of a scene and the truth about it.

    pairs : (k, 2) triangles that cross; distance : [m] of bodies that do not; overlap : of bodies that do
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


def measure(
    frames: int, refinements: int, depths: list[list[int]], layers: list[int], report: Callable
) -> pd.DataFrame:
    """Measure the rows of collision_precision.csv: one for each scene, structure and layer, and one for whole trees.

    layers : at which trees stop; other arguments as of ``compare_trees.measure``
    Whole trees test triangles. Errors are against ``overlap``.
    """
    rows = []
    kinds: list[tuple[str, tuple[int, int] | None]] = [("sphere", None), ("aabb", None)]
    kinds += [("composite", (upper, middle)) for upper, middle in depths]
    for scene in (make(refinements) for make in (two_livers, instrument_press, instrument_approach, livers_apart)):
        course = _course(scene, frames)
        for structure, deep in kinds:
            for layer in [*layers, None]:
                row = {"scene": scene.name, "structure": structure, "depths": "/".join(map(str, deep or ()))}
                rows.append(row | _row(scene, course, structure, deep, layer))
        report(scene.name)
    return pd.DataFrame(rows)


def _course(scene: Moving, frames: int) -> list[Frame]:
    spheres, found = [Tree(at, cells, "sphere") for at, cells in zip(scene.at(0.0), scene.triangles, strict=True)], []
    for time in (np.arange(frames) + 0.5) / frames:
        points, around = scene.at(time), zip(scene.at(time - SPAN), scene.at(time + SPAN), strict=True)
        velocities = [(after - before) / (2 * SPAN) for before, after in around]
        pairs = crossing(points, scene.triangles)
        apart = 0.0 if len(pairs) else distance(points, spheres)
        shared = overlap(points, velocities, scene.triangles) if len(pairs) else None
        found.append(Frame(points, velocities, pairs, apart, shared))
    return found


def _row(scene: Moving, course: list[Frame], structure: str, deep: tuple[int, int] | None, layer: int | None) -> dict:
    trees = RefittedTrees(structure, deep, scene.triangles, course[0].points, layer)
    find: Callable[..., ContactPoints] = triangle_contacts if layer is None else stopped_contacts
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


def _judge(contacts: ContactPoints, frame: Frame, true: np.ndarray) -> dict[str, float]:
    """Compare the contacts of a frame with the truth; lengths in m.

    The response is the direction of the contacts' mean, weighted with depths, times the largest depth: a penalty force
    is proportional to it. It is zero without contacts, or where they cancel.
    """
    pushed = contacts.depths @ contacts.directions
    length = float(np.linalg.norm(pushed))
    direction = pushed / length if length > 0.0 else np.zeros(3)
    moved = float(contacts.depths.max(initial=0.0)) * direction
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
