"""Detect mistakes of an engine's adapter in its answers: another unit, positions, other axes, another order.

Each test is passed by every answer near the truth, and by one that is merely inaccurate.
"""

from itertools import permutations

import numpy as np
from scipy.optimize import linear_sum_assignment

UNITS = {1e6: "micrometres", 1000.0: "millimetres", 100.0: "centimetres", 39.37: "inches"}
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
SMOOTH = 0.3
"""Share of the roughness of a random order, below which the truth has to be for order to show."""
LIKE, NEARER = 0.35, 0.5
"""Answers were meant that are unlike the truth by less than LIKE, and by less than NEARER times the given ones."""
HELD = 0.02
"""Share of the peak by which a point that the truth never moves may move unnoted."""


def slip(
    answers: np.ndarray, truth: np.ndarray, points: np.ndarray, triangles: np.ndarray, places: np.ndarray | None
) -> str:
    """Return a phrase on a mistake of the adapter in static answers, with its remedy, or "".

    answers, truth : (k, p, 3) [m] of questions that were answered
    points : (p, 3) [m] asked; triangles : (t, 3) between them
    places : (k, 3) [m] where each question acts, None where questions have no order to mistake
    """
    if not len(answers):
        return ""
    mistake = _scaled(answers, truth) or _positions(answers, truth, points) or _turned(answers, truth)
    if not mistake and places is not None:
        mistake = _loads_permuted(answers, truth, places)
    return mistake or out_of_order(answers, truth, triangles)


def oddities(answers: np.ndarray, truth: np.ndarray) -> list[str]:
    """Return phrases on oddities of answers (k, p, 3) [m] that may be no mistakes."""
    if not answers.any():
        return ["is 0 everywhere" if len(answers) else "has no answer to any question with a truth"]
    sizes = np.linalg.norm(truth, axis=2)
    held = sizes.max(axis=0) <= 1e-9 * sizes.max()
    share = float(np.linalg.norm(answers[:, held], axis=2).max(initial=0.0) / sizes.max())
    return [f"moves points that are held by up to {100 * share:.2g} % of the peak"] if share > HELD else []


def over_time(answers: np.ndarray, truth: np.ndarray, step_s: float) -> str:
    """Return a phrase on a mistake over time of a motion (f, p, 3) [m] at instants ``step_s`` apart, or ""."""
    # an answer of 0 everywhere while the truth moves is that of t = 0
    if answers.any() and not answers[0].any() and np.abs(truth[0]).max() > 1e-3 * np.abs(truth).max():
        return "is at rest at the first instant; leave out what is at t = 0"
    if _far_better(answers[::-1], answers, truth):
        return "is that of the last instant first; give instants in their order"
    if _far_better(step_s * (np.cumsum(answers, axis=0) - 0.5 * answers), answers, truth):
        return "is a velocity, as its sum over time is the truth; give displacements from rest"
    return _shifted(answers, truth)


def _shifted(answers: np.ndarray, truth: np.ndarray) -> str:
    """Detect a motion whose instants are shifted by one; return a phrase with the remedy, or ""."""
    if len(truth) < 3:
        return ""
    error_here = _relative(answers[1:-1], truth[1:-1])
    for step, remedy in ((-1, "leave out what is at t = 0"), (1, "begin with the first instant")):
        if _relative(answers[1:-1], truth[1 + step : len(truth) - 1 + step]) < min(SHIFTED * error_here, SAME):
            return f"is at each instant that of the {'one before' if step < 0 else 'next one'}; {remedy}"
    return ""


def _relative(answers: np.ndarray, truth: np.ndarray) -> float:
    return float(np.linalg.norm(answers - truth) / np.linalg.norm(truth))


def _cosine(a: np.ndarray, b: np.ndarray) -> float:
    sizes = float(np.linalg.norm(a) * np.linalg.norm(b))
    return float((a * b).sum()) / sizes if sizes > 0.0 else 0.0


def _unlike(answers: np.ndarray, truth: np.ndarray) -> float:
    """Return the sine of the angle between them, 1 beyond a right angle: their error but for a common factor."""
    return float(np.sqrt(max(0.0, 1.0 - max(0.0, _cosine(answers, truth)) ** 2)))


def _far_better(changed: np.ndarray, answers: np.ndarray, truth: np.ndarray) -> bool:
    """Whether ``changed`` answers fit the truth but for a common factor, and unchanged ones do not."""
    like = _unlike(changed, truth) < min(LIKE, NEARER * _unlike(answers, truth))
    return like and _relative(changed, truth) < _relative(answers, truth)


def _turned(answers: np.ndarray, truth: np.ndarray) -> str:
    """Detect axes in another order or direction; return a phrase with the remedy, or ""."""
    products = np.einsum("kpi,kpj->ij", answers, truth)
    order = max(permutations(range(3)), key=lambda axes: sum(abs(products[axes, range(3)])))
    signs = np.where(products[order, range(3)] < 0.0, -1.0, 1.0)
    if not _far_better(signs * answers[..., order], answers, truth):
        return ""
    words = ", ".join(("-" if sign < 0.0 else "") + "xyz"[axis] for sign, axis in zip(signs, order, strict=True))
    return f"fits far better if its x, y, z are taken as {words}; give them along the axes of points_m"


def _scaled(answers: np.ndarray, truth: np.ndarray) -> str:
    """Detect another unit or the opposite sign: the truth's shape, by a factor that no stiffness has."""
    alike, ratio = _cosine(answers, truth), float((answers * truth).sum() / (truth * truth).sum())
    if alike < -ALIKE:
        return "points against the force; give displacements from rest to the deformed state"
    if alike < ALIKE:
        return ""
    factor = min(UNITS, key=lambda each: abs(np.log(ratio / each)))
    if factor / WITHIN < ratio < factor * WITHIN:
        return f"is {ratio:.3g} times the truth, as if in {UNITS[factor]}; give metres"
    return ""


def _positions(answers: np.ndarray, truth: np.ndarray, points: np.ndarray) -> str:
    """Detect deformed positions: less the rest positions they are like the truth, and unchanged they are not."""
    moved = answers - points
    nearer = _relative(answers, truth) > 2.0 and _relative(moved, truth) < 0.5 * _relative(answers, truth)
    if nearer and _cosine(moved, truth) > ALIKE:
        return "holds positions and not displacements; subtract the positions at rest"
    return ""


def out_of_order(answers: np.ndarray, truth: np.ndarray, triangles: np.ndarray) -> str:
    """Detect points in another order: the truth's lengths, but neighbours that differ as much as any two points."""
    if _relative(answers, truth) < APART:
        return ""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    lengths = [np.sort(np.linalg.norm(each, axis=2), axis=1) for each in (answers, truth)]
    if _relative(*lengths) > LIKE:
        return ""
    if _roughness(answers, edges) > ROUGH and _roughness(truth, edges) < SMOOTH:
        return "has the lengths of the truth at other points, as if their order were another; keep that of the points"
    return ""


def _roughness(moved: np.ndarray, edges: np.ndarray) -> float:
    """Return the mean square difference along ``edges`` over that of any two points."""
    along = ((moved[:, edges[:, 0]] - moved[:, edges[:, 1]]) ** 2).sum(axis=2).mean()
    return float(along / max(2.0 * moved.var(axis=1).sum(axis=1).mean(), 1e-300))


def _loads_permuted(answers: np.ndarray, truth: np.ndarray, places: np.ndarray) -> str:
    """Detect questions in another order: answers that fit the truth of another question far better.

    places : (k, 3) [m] where each question acts. At one place another stiffness does the same, but not for a whole
    cycle of answers, as it makes all of them larger or all smaller.
    """
    if len(answers) < 2:
        return ""
    flat, true = (each.reshape(len(each), -1) for each in (answers, truth))
    sizes = (true * true).sum(axis=1)
    errors = np.sqrt(np.maximum((flat * flat).sum(axis=1)[:, None] + sizes - 2.0 * flat @ true.T, 0.0) / sizes)
    _, matched = linear_sum_assignment(errors)
    numbers = np.arange(len(matched))
    apart = np.linalg.norm(places - places[matched], axis=1) > 0.0
    matches = apart & (errors[numbers, matched] < SAME) & (errors[numbers, numbers] > 3.0 * errors[numbers, matched])
    in_cycle = (errors[numbers, matched] < LIKE) & (errors[numbers, matched] < NEARER * errors[numbers, numbers])
    for _ in numbers:
        in_cycle &= in_cycle[matched]
    if max(matches.sum(), in_cycle.sum()) >= 2:
        i = int(np.flatnonzero(matches | in_cycle)[0])
        return f"has in question {i} the answer to question {matched[i]}; keep the order of the loads"
    return ""
