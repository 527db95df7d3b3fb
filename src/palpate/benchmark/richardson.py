"""Carry the answers of ever finer members to their limit, with what that limit may be off by (Richardson 1911).

Members are refined along one axis or more: all elements, those at a place, steps. Each halving along an axis divides
its error by about the same ratio, which three members show: one number for all nodes, never changed. The lower it is,
the less sure is the limit. Axes are carried to their limits one by one, on lines that cross in one member; what that
leaves out is how the effect of one axis changes with another.
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
"""By how much the ratio of all finer levels may be below the one that was found: on nailed organs it is 1.9 to 2.1."""
NUMBER_RATIOS = (1.8, 18.0)
"""Ratios of the changes of a number between which its limit is believed."""
CROSS = (0, 0), (1, 0), (0, 1), (1, 1), (1, 2), (2, 1)
"""How often each of two axes is halved for a limit over both."""


def ratio(levels: np.ndarray) -> Any:
    """Return by how much the last halving has reduced the change, from the last three of ``levels``.

    Vectors (m, ..., 3) have one ratio, NaN where nothing changes. Numbers (m, k) or (m,) have one each, negative where
    they turn and infinite where they change no more.
    """
    before, last = np.asarray(levels[-2] - levels[-3]), np.asarray(levels[-1] - levels[-2])
    if last.ndim < 2:
        return np.divide(before, last, out=np.full(last.shape, np.inf), where=last != 0.0)
    length = float(np.linalg.norm(last))
    return float(np.linalg.norm(before)) / length if length > 0.0 else float("nan")


def limit(levels: np.ndarray, rate: float | None = None) -> np.ndarray:
    """Extrapolate ``levels`` (m, n, 3) [m] to their limit (n, 3) [m]; the last where none changes.

    rate : the ratio, if it is known, which two levels are enough for; else it is that of the last three
    """
    rate = ratio(levels) if rate is None else rate
    return levels[-1] if np.isnan(rate) else levels[-1] + (levels[-1] - levels[-2]) / (rate - 1.0)


def doubt(levels: np.ndarray) -> np.ndarray:
    """Return the vector (n, 3) [m] whose length says how far ``limit`` may be from the truth, from (m, n, 3) [m].

    With four levels it is the change of the limit from the first three to the last three, of which the last limit has
    a part only. With three it is the change from the limit of the first two to that of the last two, with the one ratio
    there is: what the scalar ratio leaves unexplained.
    """
    if len(levels) > 3:
        return limit(levels) - limit(levels[:-1])
    first, last = levels[-2] - levels[-3], levels[-1] - levels[-2]
    rate = ratio(levels)
    return np.zeros_like(last) if np.isnan(rate) else (rate * last - first) / (rate - 1.0)


def estimate(levels: np.ndarray, rate: float | None = None) -> tuple[np.ndarray, tuple[np.ndarray, ...]]:
    """Return the best answer (n, 3) [m] that ``levels`` (m, n, 3) [m] show, and vectors as long as its own errors.

    The limit may be off by ``doubt``, and by what a ratio that is lower by RATIO_DOUBT would change of it, which grows
    as the ratio falls. Where no limit is to be seen, the finest level is the answer: it may be off by its last change
    if levels close in quickly, and by what is left at the ratio SLOWEST if they hardly do.

    rate : the ratio, if it is known; then the limit may be off by its last change, or of two levels by RATIO_DOUBT
    Numbers (m, k) or (m,) have ``number_limits``.
    """
    last = np.asarray(levels[-1] - levels[-2])
    if last.ndim < 2:
        numbers, off = number_limits(levels)
        return numbers, (off,)
    if rate is not None:
        found = limit(levels, rate)
        return found, (found - limit(levels[:-1], rate) if len(levels) > 2 else _of_lower(rate, last),)
    rate = ratio(levels)
    if SLOWEST <= rate <= RATIOS[1]:
        return limit(levels), (doubt(levels), _of_lower(rate, last))
    return levels[-1], (last / (SLOWEST - 1.0) if rate < SLOWEST else last,)


def _of_lower(rate: float, last: np.ndarray) -> np.ndarray:
    return RATIO_DOUBT / (rate - 1.0) ** 2 * last


def number_limits(levels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the limits (...) of numbers on three meshes (3, ...), and how far each may be off.

    Where the changes of one shrink as they do for an order of 1 to 4, it is extrapolated and may be off by as much as
    that has changed it. Elsewhere it is that of the finest mesh, and may be off by the larger of the last change and a
    third of the one before.
    """
    rates, before, last = ratio(levels), levels[1] - levels[0], levels[2] - levels[1]
    seen = (NUMBER_RATIOS[0] <= rates) & (rates <= NUMBER_RATIOS[1])
    more = np.where(seen, last / (np.where(seen, rates, 2.0) - 1.0), 0.0)
    return levels[2] + more, np.where(seen, np.abs(more), np.maximum(np.abs(last), np.abs(before) / 3.0))


Answer = TypeVar("Answer", bound=tuple)
"""A named tuple of arrays: of vectors (..., 3), which have one ratio, or of numbers (k,) or (), which have one each."""


def combined(factors: Sequence[float], answers: Sequence[Answer]) -> Answer:
    """Return the sum of answers, each times its factor."""
    kind: Any = type(answers[0])
    parts = zip(*answers, strict=True)
    return kind(*(sum(factor * each for factor, each in zip(factors, part, strict=True)) for part in parts))


@dataclass(frozen=True)
class Limit(Generic[Answer]):
    """The limit of answers over several axes.

    answer : the best that they show
    ratios : for each axis, by how much the last halving has reduced the change of each part of the answer
    off : for each axis, and then for each two, the vectors and numbers that the answer may be off by
    """

    answer: Answer
    ratios: list[Any]
    off: list[list[Answer]]

    def own(self, errors: Callable[[Answer, Answer], Sequence[float]]) -> np.ndarray:
        """Return the k errors that the answer may have itself, without signs: (axes and then pairs of them, k).

        errors : measures an answer against a true one
        """
        wrong = [[combined((1.0, 1.0), (self.answer, each)) for each in off] for off in self.off]
        return np.array([np.max([np.abs(errors(each, self.answer)) for each in off], axis=0) for off in wrong])


def limit_over(answers: Mapping[Any, Answer], centre: tuple[int, ...], rates: Sequence[float | None]) -> Limit[Answer]:
    """Carry answers to their limit over all axes that they were refined along.

    answers : by how often each axis was halved, as ``centre`` is
    centre : where the lines cross along which each axis is carried to its limit
    rates : the ratio of each axis if it is known, else None
    What an axis may be off by is that of the longest line along it, which may lie beside the centre. What two may be
    off by together is how the effect of the second is changed by halving the first until the centre.
    """
    kind: Any = type(answers[centre])
    limits, ratios, off = [], [], []
    for axis, rate in enumerate(rates):
        through = _line(answers, centre, axis)
        limits.append(_along(through, rate)[0])
        off.append(_along(max((_line(answers, key, axis) for key in answers), key=len), rate)[1])
        parts = zip(*through, strict=True)
        ratios.append(kind(*(ratio(np.array(part)) if rate is None else rate for part in parts)))
    for first, second in combinations(range(len(rates)), 2):
        before = tuple(halved - (axis == first) for axis, halved in enumerate(centre))
        if before in answers:
            here, there = (_line(answers, key, second)[:2] for key in (centre, before))
            if rates[second] is not None:
                here[1], there[1] = (_along(line, rates[second])[0] for line in (here, there))
            off.append([combined((1.0, -1.0, -1.0, 1.0), (here[1], here[0], there[1], there[0]))])
    summed = combined([1.0] * len(limits) + [1.0 - len(limits)], [*limits, answers[centre]])
    return Limit(summed, ratios, off)


def _line(answers: Mapping[Any, Answer], key: tuple[int, ...], axis: int) -> list[Answer]:
    """Return the answers through that of ``key`` along an axis, coarse first."""
    beside = key[:axis], key[axis + 1 :]
    return [answers[each] for each in sorted(answers) if (each[:axis], each[axis + 1 :]) == beside]


def _along(line: Sequence[Answer], rate: float | None) -> tuple[Answer, list[Answer]]:
    """Return the limit of a line, and what it may be off by: nothing where a part has less to say than others."""
    kind: Any = type(line[0])
    limits, off = zip(*(estimate(np.array(part), rate) for part in zip(*line, strict=True)), strict=True)
    return kind(*limits), [kind(*each) for each in zip_longest(*off, fillvalue=0.0)]


def rejection(*checks: tuple[bool, str]) -> str:
    """Return why a limit is not believed: what each of ``checks`` says that is not passed, or "" if all are."""
    return "; ".join(reason for passed, reason in checks if not passed)
