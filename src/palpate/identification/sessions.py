"""Compare sessions at places that two of them pressed, so that sessions that contradict each other are not averaged."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from palpate.identification.fit import loading
from palpate.identification.presses import Press, PressRecords

NEAR_RADII = 1.0
"""Distance of places that count as one, in radii of the instrument."""
LEAST_RATIO, DEVIATIONS = 1.25, 3.0
"""Sessions contradict where their forces differ by more than this factor, and by more standard errors than this."""
LEAST_PLACES = 3
"""Below this number of places the spread between them is not known."""


class Comparison(NamedTuple):
    """Comparison of the ``first`` and the ``second`` session of a specimen, at the ``places`` that both pressed.

    ratio : median over places of the second's force over the first's
    error : standard error of the log of ratio
    """

    specimen: str
    first: str
    second: str
    places: int
    ratio: float
    error: float

    @property
    def contradicts(self) -> bool:
        """Whether the forces differ by more than the spread between places explains."""
        apart = abs(np.log(self.ratio))
        return bool(self.may_contradict and self.places >= LEAST_PLACES and apart > DEVIATIONS * self.error)

    @property
    def may_contradict(self) -> bool:
        """Whether the forces differ by more than LEAST_RATIO, on however few places."""
        return bool(abs(np.log(self.ratio)) > np.log(LEAST_RATIO))


def compare_sessions(records: PressRecords) -> list[Comparison]:
    """Compare each two sessions of a specimen that pressed the same places, by name or within a radius."""
    comparisons = []
    for specimen in dict.fromkeys(press.specimen for press in records.presses):
        presses = [press for press in records.presses if press.specimen == specimen]
        for first, second in combinations(dict.fromkeys(press.session for press in presses), 2):
            group_a = [press for press in presses if press.session == first]
            group_b = [press for press in presses if press.session == second]
            logs = [log for a, b in _pairs(group_a, group_b, records) if (log := _log_ratio(a, b)) is not None]
            if logs:
                spread = 1.4826 * float(np.median(np.abs(np.array(logs) - np.median(logs))))
                error = 1.2533 * spread / np.sqrt(len(logs))  # of the median, as of normal values
                comparisons.append(
                    Comparison(specimen, first, second, len(logs), float(np.exp(np.median(logs))), error)
                )
    return comparisons


def consistent_parts(records: PressRecords, comparisons: list[Comparison]) -> list[tuple[str, PressRecords]]:
    """Divide records by specimen, and by session for those specimens whose sessions contradict each other.

    Each part has a name, that of its specimen and session; a single one is called all.
    """
    divided = {each.specimen for each in comparisons if each.contradicts}
    keys = [(press.specimen, press.session if press.specimen in divided else "") for press in records.presses]
    parts = []
    for key in dict.fromkeys(keys):
        presses = tuple(press for press, press_key in zip(records.presses, keys, strict=True) if press_key == key)
        words = [word for word in key if word and len(presses) < len(keys)]
        parts.append((" ".join(words) or "all", replace(records, presses=presses)))
    return parts


def _pairs(group_a: list[Press], group_b: list[Press], records: PressRecords) -> Iterator[tuple[Press, Press]]:
    """Yield the presses of two sessions at the same place, by its name or by a distance of at most NEAR_RADII."""
    by_name = {press.place: press for press in group_b if press.place}
    placed = [press for press in group_b if press.at_m is not None]
    tree = cKDTree([press.at_m for press in placed]) if placed else None
    near = NEAR_RADII * (records.instrument.radius_m if records.instrument else 0.0)
    for press in group_a:
        if press.place in by_name:
            yield press, by_name[press.place]
        elif tree is not None and press.at_m is not None:
            distance, nearest = tree.query(press.at_m)
            if distance <= near:
                yield press, placed[nearest]


def _log_ratio(one: Press, other: Press) -> float | None:
    """Return the log of forces of ``other`` over ``one``, at the depth that both reach."""
    (depth, force), (other_depth, other_force) = loading(one), loading(other)
    common_depth = min(depth[-1], other_depth[-1])
    depths = np.linspace(0.5, 1.0, 4) * common_depth
    sum_one, sum_other = np.interp(depths, depth, force).sum(), np.interp(depths, other_depth, other_force).sum()
    return float(np.log(sum_other / sum_one)) if sum_one > 0.0 and sum_other > 0.0 else None
