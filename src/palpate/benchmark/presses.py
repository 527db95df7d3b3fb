"""Choose the presses of the trade-off: discs at well-spread contacts, as deep as asked if the model bears that."""

import warnings
from collections import Counter
from collections.abc import Callable, Mapping, Sequence

import numpy as np
import pandas as pd

from palpate.benchmark.loads import COLUMNS
from palpate.benchmark.press_search import DEEPEST, FAILED, PRESSURE, SOUND, PressSearch, Tried
from palpate.bodies.body import Body
from palpate.bodies.contacts import kept_contacts
from palpate.errors import InputError

MOST_OF_SIZE = 0.5
"""Share of the body's size that the radius of a press may have."""
REACHED = ["peak_of_size", "pressure_of_young", "least_det", "volume_change"]
"""Columns of what a press reaches: smallest det F, change of the body's volume over that at rest, and the like."""
PRESS_COLUMNS = [*COLUMNS, "magnitude", "tilt_degrees", *REACHED, "capped"]
"""Columns of the table."""


def choose_presses(
    body: Body,
    contacts_count: int | None,
    presses: Sequence[Mapping],
    regime: Mapping,
    radius_m: float,
    seed: int,
    progress: Callable = iter,
    also: Sequence[int] = (),
) -> pd.DataFrame:
    """Choose every one of ``presses`` at each of ``contacts_count`` contacts, as ``kept_contacts`` spreads them.

    also : coarse nodes that are pressed beside these
    presses : each with ``magnitude``, and ``tilt_degrees`` from the inward normal, towards a seeded random side
    regime : ``peak_of_size``, by whose share of the body's size a press of magnitude 1 moves it at most;
        ``pressure_of_young``, the peak pressure 2 F / (π radius²) as a share of Young's modulus that no press exceeds,
        by default PRESSURE. Without peak_of_size a press of magnitude 1 has that pressure, or a peak of DEEPEST.

    Forces are found to within NEAR with quadratic elements on the last level but one, whose nodes are those of the
    finest. A press at which an element is inverted, or squeezed below SOUND, or beyond which the body collapses, is
    lowered, and at the same contact no press of a smaller magnitude has more than its share of that force. The column
    ``capped`` is "no", or where a press is lower than asked "pressure", "peak", "inverted", "squeezed" or "unstable";
    a warning says how many are.

    Raises InputError for a radius that ``check_radius`` refuses, and where fewer contacts can be pressed; NotConverged
    if a force is not found.
    """
    check_radius(body, radius_m)
    contacts = _contacts(body, contacts_count, also)
    search = PressSearch(body, regime, radius_m)
    sides = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, (len(contacts), len(presses)))
    rows: list[list] = []
    for contact, angles in progress(list(zip(contacts, sides, strict=True))):
        directions = [
            oblique(body.fine.normals[contact], press["tilt_degrees"], side)
            for press, side in zip(presses, angles, strict=True)
        ]
        magnitudes = [press["magnitude"] for press in presses]
        pressed = _in_order(search, int(contact), directions, magnitudes)
        for press, direction, (found, capped) in zip(presses, directions, pressed, strict=True):
            load = [len(rows), int(contact), *(found.newtons * direction), radius_m]
            told: list = [found.peak / body.fine.size, search.pressure(found.newtons), found.least_det]
            told += [search.volume_change(found.moved), capped]
            rows.append([*load, press["magnitude"], press["tilt_degrees"], *told])
    table = pd.DataFrame(rows, columns=PRESS_COLUMNS)
    _warn(body.name, table["capped"], regime.get("pressure_of_young", PRESSURE))
    return table


def _contacts(body: Body, count: int | None, also: Sequence[int]) -> np.ndarray:
    """Return ``count`` contacts and those of ``also``; InputError if there are fewer."""
    contacts = kept_contacts(body, count) if count != 0 else np.empty(0, dtype=np.int64)
    if count is not None and len(contacts) < count:
        raise InputError(
            f"bodies.{body.name}: {count} contacts are asked for and {len(contacts)} can be pressed; "
            "lower contacts, or hold less of the body."
        )
    return np.append(contacts, np.setdiff1d(also, contacts)).astype(np.int64)


def check_radius(body: Body, radius_m: float) -> None:
    """Raise InputError for a disc of no size, or of more than half the body's, which may be given in another unit."""
    size = body.fine.size
    if not 0.0 < radius_m <= MOST_OF_SIZE * size:
        remedy = "a press needs a disc" if radius_m <= 0.0 else f"the body's longest side is {size:.3g} m"
        millimetres = f", such as {1e-3 * radius_m:g} for millimetres" if 1e-3 * radius_m <= MOST_OF_SIZE * size else ""
        raise InputError(
            f"bodies.{body.name}: radius_m is {radius_m:g}, and {remedy}; give a radius in m of at most half of the "
            f"longest side{millimetres if radius_m > 0.0 else ''} (radius_m or radius_of_body_m of a regime, "
            "finger_radii_m, or limit_points.radius_m)."
        )


def _in_order(
    search: PressSearch, contact: int, directions: Sequence[np.ndarray], magnitudes: Sequence[float]
) -> list[tuple[Tried, str]]:
    """Find the presses of one contact, the hardest first, so that one that has to be lowered lowers gentler ones.

    Beyond a snap the peak that is asked for may be found again, at a force at which a harder press has failed.
    """
    found: dict[int, tuple[Tried, str]] = {}
    for i in sorted(range(len(magnitudes)), key=lambda i: -magnitudes[i]):
        failed = [
            (press.newtons * magnitudes[i] / magnitudes[j], why)
            for j, (press, why) in found.items()
            if why in FAILED and magnitudes[j] > magnitudes[i]
        ]
        found[i] = search.find(contact, directions[i], magnitudes[i], *min(failed, default=()))
    return [found[i] for i in range(len(magnitudes))]


def oblique(normal: np.ndarray, tilt_degrees: float, side: float) -> np.ndarray:
    """Return the unit vector (3,) against the outward ``normal`` (3,), tilted towards the angle ``side`` [rad]."""
    first = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    first /= np.linalg.norm(first)
    tangent = np.cos(side) * first + np.sin(side) * np.cross(normal, first)
    tilt = np.radians(tilt_degrees)
    return np.sin(tilt) * tangent - np.cos(tilt) * normal


def _warn(name: str, capped: pd.Series, pressure: float) -> None:
    """Warn of presses that are lower than asked."""
    counts = Counter(capped)
    remedy = "lower the regime's peak_of_size or pressure_of_young, or give a larger radius_m, to have all as asked"
    reasons = {
        "peak": f"would move the body by more than {DEEPEST:g} of its size; give peak_of_size to choose how deep",
        "pressure": f"would exceed a peak pressure of {pressure:g} of Young's modulus; {remedy}",
        "inverted": f"would turn an element inside out; {remedy}",
        "squeezed": f"would press an element to less than {SOUND:g} of its volume; {remedy}",
        "unstable": f"would be beyond a limit of stability, where the body collapses; {remedy}",
    }
    for reason, words in reasons.items():
        if counts[reason]:
            told = f"bodies.{name}: {counts[reason]} of {len(capped)} presses are lowered, as they {words}."
            warnings.warn(told, stacklevel=3)
