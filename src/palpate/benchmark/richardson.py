"""Extrapolate answers on ever finer meshes or shorter steps to their limit, with its own error (Richardson 1911).

Answers are refined along one axis or more: all elements, those at a place, time steps. Each halving along an axis
divides the error by about the same ratio, which three answers show; a field has one ratio for all its nodes. The lower
the ratio, the larger is the limit's own error. Along each axis answers form a line; all lines cross in one answer, and
each is extrapolated by itself. That leaves out how the effect of one axis changes with another.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, zip_longest
from typing import Any, Generic, TypeVar

import numpy as np

RATIOS = (2.2, 8.0)
"""Ratios of convergence between which a limit is believed, however far it is from the finest level: from the order 1.1
to the order 3 that quadratic elements have where the answer is smooth."""
SLOWEST = 1.3
"""The lowest ratio with which there is a limit to be seen. At the rim of held nodes the error falls by the order of 1,
a ratio of two, as displacements there grow with the root of the distance."""
RATIO_DOUBT = 0.25
"""By how much the ratio of all finer levels may be below the observed one: on nailed organs it is 1.9 to 2.1."""
NUMBER_RATIOS = (1.8, 18.0)
"""Ratios of the changes of a number between which its limit is believed."""
CROSS = (0, 0), (1, 0), (0, 1), (1, 1), (1, 2), (2, 1)
"""How often each of two axes is halved for a limit over both."""


def ratio(levels: np.ndarray) -> Any:
    """Return the ratio of the last two changes between ``levels``, coarse first, of which there are three at least.

    Vector fields (m, ..., 3) have one ratio of their norms, NaN where nothing changes. Numbers (m, k) or (m,) have one
    each, negative where the change has turned and infinite where the last change is 0.
    """
    change_before, last_change = np.asarray(levels[-2] - levels[-3]), np.asarray(levels[-1] - levels[-2])
    if last_change.ndim < 2:
        return np.divide(change_before, last_change, out=np.full(last_change.shape, np.inf), where=last_change != 0.0)
    length = float(np.linalg.norm(last_change))
    return float(np.linalg.norm(change_before)) / length if length > 0.0 else float("nan")


def limit(levels: np.ndarray, rate: float | None = None) -> np.ndarray:
    """Extrapolate displacements ``levels`` (m, n, 3) [m] to their limit (n, 3) [m]; the last where none changes.

    rate : the ratio of changes if it is known, for which two levels are enough; else that of the last three is taken
    """
    rate = ratio(levels) if rate is None else rate
    return levels[-1] if np.isnan(rate) else levels[-1] + (levels[-1] - levels[-2]) / (rate - 1.0)


def doubt(levels: np.ndarray) -> np.ndarray:
    """Return vectors (n, 3) [m] as long as the own error of ``limit``, from displacements (m, n, 3) [m].

    With four levels they are the change from the limit of the first three to that of the last three. With three they
    are the change from the limit of the first two to that of the last two by one ratio, which is what that ratio leaves
    unexplained.
    """
    if len(levels) > 3:
        return limit(levels) - limit(levels[:-1])
    change_before, last_change = levels[-2] - levels[-3], levels[-1] - levels[-2]
    rate = ratio(levels)
    return np.zeros_like(last_change) if np.isnan(rate) else (rate * last_change - change_before) / (rate - 1.0)


def estimate(levels: np.ndarray, rate: float | None = None) -> tuple[np.ndarray, tuple[np.ndarray, ...]]:
    """Return the best estimate (n, 3) [m] from ``levels`` (m, n, 3) [m], and fields whose lengths are its own errors.

    rate : the known ratio of changes, or None: the ratio is then found. Estimate, and its one or two errors, if it is
        known: the limit; how it moved with the last level, or, with two levels, by a ratio lower by RATIO_DOUBT
        found from SLOWEST to the largest of RATIOS: the limit; ``doubt``, and its move by a ratio lower by RATIO_DOUBT
        found lower: the finest level; the sum of all further changes, if their ratio were SLOWEST
        found higher: the finest level; the last change
    Numbers (m, k) or (m,) are estimated by ``number_limits``.
    """
    change = np.asarray(levels[-1] - levels[-2])
    if change.ndim < 2:
        numbers, own_error = number_limits(levels)
        return numbers, (own_error,)
    if rate is not None:
        known = limit(levels, rate)
        return known, (known - limit(levels[:-1], rate) if len(levels) > 2 else _change_by_lower_ratio(rate, change),)
    rate = ratio(levels)
    if SLOWEST <= rate <= RATIOS[1]:
        return limit(levels), (doubt(levels), _change_by_lower_ratio(rate, change))
    return levels[-1], (change / (SLOWEST - 1.0) if rate < SLOWEST else change,)


def _change_by_lower_ratio(rate: float, last_change: np.ndarray) -> np.ndarray:
    return RATIO_DOUBT / (rate - 1.0) ** 2 * last_change


def number_limits(levels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the limits (...) of numbers on three meshes (3, ...), and the own error of each.

    A number whose ratio of changes is within NUMBER_RATIOS, as for an order of 1 to 4, is extrapolated, and its own
    error is the change by that. Another one stays as on the finest mesh, with the larger of the last change and a third
    of the one before as its own error.
    """
    ratios, change_before, last_change = ratio(levels), levels[1] - levels[0], levels[2] - levels[1]
    is_regular = (NUMBER_RATIOS[0] <= ratios) & (ratios <= NUMBER_RATIOS[1])
    correction = np.where(is_regular, last_change / (np.where(is_regular, ratios, 2.0) - 1.0), 0.0)
    own_error = np.where(is_regular, np.abs(correction), np.maximum(np.abs(last_change), np.abs(change_before) / 3.0))
    return levels[2] + correction, own_error


Answer = TypeVar("Answer", bound=tuple)
"""A named tuple of arrays: of vectors (..., 3), which have one ratio, or of numbers (k,) or (), which have one each."""


def combined(factors: Sequence[float], answers: Sequence[Answer]) -> Answer:
    """Return the linear combination of answers with ``factors``."""
    kind: Any = type(answers[0])
    parts = zip(*answers, strict=True)
    return kind(*(sum(factor * each for factor, each in zip(factors, part, strict=True)) for part in parts))


@dataclass(frozen=True)
class Limit(Generic[Answer]):
    """The limit of answers over several axes.

    answer : the best estimate
    ratios : for each axis an answer with the ratio of changes of each of its parts
    off : for each axis, and then for each pair, the own errors of ``answer``, as vectors or numbers to add to it
    """

    answer: Answer
    ratios: list[Any]
    off: list[list[Answer]]

    def own(self, errors: Callable[[Answer, Answer], Sequence[float]]) -> np.ndarray:
        """Return the answer's own errors without signs, (axes and then pairs, k), as k ``errors`` of an answer.

        errors : measures an answer against a true one
        """
        displaced = [[combined((1.0, 1.0), (self.answer, each)) for each in off] for off in self.off]
        return np.array([np.max([np.abs(errors(each, self.answer)) for each in off], axis=0) for off in displaced])


def limit_over(answers: Mapping[Any, Answer], centre: tuple[int, ...], rates: Sequence[float | None]) -> Limit[Answer]:
    """Extrapolate answers to their limit over all axes: the answer at ``centre``, and the change along each axis.

    answers : by how often each axis was halved
    centre : of the answer in which the lines along all axes cross
    rates : the ratio of changes along each axis if it is known, else None
    The own error of an axis is that of the longest line along it, which may lie beside the centre. That of a pair is
    the effect of the second axis ``after`` the last halving of the first, up to the centre, less that ``before``.
    """
    kind: Any = type(answers[centre])
    limits, ratios, own_errors = [], [], []
    for axis, rate in enumerate(rates):
        through_centre = _line(answers, centre, axis)
        longest = max((_line(answers, key, axis) for key in answers), key=len)
        limits.append(_estimate_answers(through_centre, rate)[0])
        own_errors.append(_estimate_answers(longest, rate)[1])
        parts = zip(*through_centre, strict=True)
        ratios.append(kind(*(ratio(np.array(part)) if rate is None else rate for part in parts)))
    for axis_1, axis_2 in combinations(range(len(rates)), 2):
        key_before = tuple(halvings - (axis == axis_1) for axis, halvings in enumerate(centre))
        if key_before in answers:
            after, before = (_line(answers, key, axis_2)[:2] for key in (centre, key_before))
            if rates[axis_2] is not None:
                after[1], before[1] = (_estimate_answers(line, rates[axis_2])[0] for line in (after, before))
            own_errors.append([combined((1.0, -1.0, -1.0, 1.0), (after[1], after[0], before[1], before[0]))])
    limit_of_all = combined([1.0] * len(limits) + [1.0 - len(limits)], [*limits, answers[centre]])
    return Limit(limit_of_all, ratios, own_errors)


def _line(answers: Mapping[Any, Answer], key: tuple[int, ...], axis: int) -> list[Answer]:
    """Return the answers on the line along ``axis`` through that of ``key``, coarse first: others are halved alike."""
    other_axes = key[:axis], key[axis + 1 :]
    return [answers[each] for each in sorted(answers) if (each[:axis], each[axis + 1 :]) == other_axes]


def _estimate_answers(line: Sequence[Answer], rate: float | None) -> tuple[Answer, list[Answer]]:
    """Return the ``estimate`` of each part of the answers along a line, and own errors, 0 where a part has fewer."""
    kind: Any = type(line[0])
    limits, own_errors = zip(*(estimate(np.array(part), rate) for part in zip(*line, strict=True)), strict=True)
    return kind(*limits), [kind(*each) for each in zip_longest(*own_errors, fillvalue=0.0)]


def rejection(*checks: tuple[bool, str]) -> str:
    """Return the reasons, of pairs of a truth value and a reason, whose value is false; "" if all are true."""
    return "; ".join(reason for passed, reason in checks if not passed)
