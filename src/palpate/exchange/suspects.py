"""Recognise answers that are right but for a slip of the adapter: another unit, positions, another order.

Each is told by what a slip alone can do, so that no answer near the truth is refused, nor one that is merely bad.
"""

import numpy as np
from scipy.optimize import linear_sum_assignment

UNITS = {1000.0: "millimetres", 100.0: "centimetres"}
WITHIN = 2.0
"""Factor by which an answer in another unit may be too large or small beside."""
ALIKE = 0.7
"""Cosine between an answer and the truth above which the two have one shape."""
APART = 0.5
"""Relative error above which an answer is looked at for another order of its points or loads."""
SAME = 0.25
"""Relative difference below which two sets of lengths, or two answers, count as the same."""
SHIFTED = 0.2
"""Share of its error that a motion has beside the truth of another instant, below which its instants are shifted."""
ROUGH = 0.5
"""Share of the roughness of a random order, above which an answer is out of order."""
SMOOTH = 0.2
"""The same share, below which the truth must be for that to be told."""


def slip(
    answers: np.ndarray, truth: np.ndarray, points: np.ndarray, triangles: np.ndarray, places: np.ndarray | None
) -> str:
    """Return what an adapter seems to have done wrong, with its remedy, or "".

    answers, truth : (k, p, 3) [m] of questions that were answered
    points : (p, 3) [m] asked; triangles : (t, 3) between them
    places : (k, 3) [m] where each question acts, None where questions have no order to mistake
    """
    if not len(answers):
        return ""
    if told := _scaled(answers, truth):
        return told
    if told := _positions(answers, truth, points):
        return told
    if _relative(answers, truth) < APART:
        return ""
    if told := _points_permuted(answers, truth, triangles):
        return told
    return "" if places is None else _loads_permuted(answers, truth, places)


def shifted(answers: np.ndarray, truth: np.ndarray) -> str:
    """Return in what a motion (f, p, 3) [m] is that of the instant before or after, with its remedy, or ""."""
    if len(truth) < 3:
        return ""
    here = _relative(answers[1:-1], truth[1:-1])
    for step, remedy in ((-1, "leave out what is at t = 0"), (1, "begin with the first instant")):
        if _relative(answers[1:-1], truth[1 + step : len(truth) - 1 + step]) < min(SHIFTED * here, SAME):
            return f"is at each instant that of the {'one before' if step < 0 else 'next one'}; {remedy}"
    return ""


def _relative(answers: np.ndarray, truth: np.ndarray) -> float:
    return float(np.linalg.norm(answers - truth) / np.linalg.norm(truth))


def _cosine(a: np.ndarray, b: np.ndarray) -> float:
    sizes = float(np.linalg.norm(a) * np.linalg.norm(b))
    return float((a * b).sum()) / sizes if sizes > 0.0 else 0.0


def _scaled(answers: np.ndarray, truth: np.ndarray) -> str:
    """Tell another unit, or the other sign: one shape with the truth, and a factor that is no stiffness's."""
    alike, ratio = _cosine(answers, truth), float((answers * truth).sum() / (truth * truth).sum())
    if alike < -ALIKE:
        return "points against the force; give displacements from rest to the deformed state"
    for factor, unit in UNITS.items():
        if alike > ALIKE and factor / WITHIN < ratio < factor * WITHIN:
            return f"is {ratio:.3g} times the truth, as if in {unit}; give metres"
    return ""


def _positions(answers: np.ndarray, truth: np.ndarray, points: np.ndarray) -> str:
    """Tell deformed positions: without the rest they are like the truth, and as they are far from it."""
    moved = answers - points
    nearer = _relative(answers, truth) > 2.0 and _relative(moved, truth) < 0.5 * _relative(answers, truth)
    if nearer and _cosine(moved, truth) > ALIKE:
        return "holds positions and not displacements; subtract the positions at rest"
    return ""


def _points_permuted(answers: np.ndarray, truth: np.ndarray, triangles: np.ndarray) -> str:
    """Tell points in another order: the same lengths as the truth's, but neighbours that differ as strangers do."""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    lengths = [np.sort(np.linalg.norm(each, axis=2), axis=1) for each in (answers, truth)]
    if _relative(*lengths) > SAME:
        return ""
    if _roughness(answers, edges) > ROUGH and _roughness(truth, edges) < SMOOTH:
        return "has the lengths of the truth at other points, as if their order were another; keep that of points_m"
    return ""


def _roughness(moved: np.ndarray, edges: np.ndarray) -> float:
    """Return the mean square difference along ``edges`` over that of any two points."""
    along = ((moved[:, edges[:, 0]] - moved[:, edges[:, 1]]) ** 2).sum(axis=2).mean()
    return float(along / max(2.0 * moved.var(axis=1).sum(axis=1).mean(), 1e-300))


def _loads_permuted(answers: np.ndarray, truth: np.ndarray, places: np.ndarray) -> str:
    """Tell questions in another order: each answer fits the truth of another one, at another place, far better."""
    if len(answers) < 2:
        return ""
    sizes = np.linalg.norm(truth, axis=(1, 2))
    errors = np.linalg.norm(answers[:, None] - truth[None], axis=(2, 3)) / sizes
    _, to = linear_sum_assignment(errors)
    k = np.arange(len(to))
    elsewhere = np.linalg.norm(places - places[to], axis=1) > 0.0
    if (elsewhere & (errors[k, to] < SAME) & (errors[k, k] > 3.0 * errors[k, to])).sum() >= 2:
        i = int(np.flatnonzero(elsewhere)[0])
        return f"has in question {i} the answer to question {to[i]}; keep the order of the loads"
    return ""
