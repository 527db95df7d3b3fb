"""Choose which contacts are pressed and by what forces, and convert presses to nodal forces of a level."""

import warnings
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from palpate.benchmark.accuracy import patch_nodes, peak_of
from palpate.benchmark.load import Load, loads_of
from palpate.bodies.body import Body
from palpate.bodies.contacts import sampled_contacts
from palpate.bodies.refinement import finer
from palpate.bodies.surface_quadrature import enclosed_volume
from palpate.effects.patch_load import Patch, nodal_load, patch_at, spread
from palpate.errors import InputError, NotConverged
from palpate.solvers.equilibrium import Unbuckled

FORCES = ["force_x_n", "force_y_n", "force_z_n"]
"""The columns of loads.csv that have a force."""
LOAD_COLUMNS = ["sample", "contact", *FORCES, "radius_m"]


@dataclass(frozen=True, eq=False)
class Sample:
    """A load that is simulated, a row of loads.csv, with its ``number`` and the radius of its discs [m]."""

    number: int
    load: Load
    radius_m: float

    def patches(self, body: Body) -> list[Patch]:
        """Return the disc of each press on ``body``."""
        return [patch_at(body, press.node, self.radius_m) for press in self.load.presses]

    def pressed(self, body: Body) -> np.ndarray:
        """Mark the fine surface nodes in its discs, (n_surface,) bool."""
        return np.any([patch_nodes(body.fine, press.node, self.radius_m) for press in self.load.presses], axis=0)

    def nodal(self, body: Body, level: int, order: int = 1, whole: Body | None = None) -> np.ndarray:
        """Return nodal forces (n, 3) [N] on one level of ``body``, for elements of ``order``, as ``nodal_load`` does.

        whole : ``body`` with further levels, if ``level`` is one of these; discs are on the surface of ``body``
        """
        mesh = (body if whole is None else whole).levels[level]
        pressed = zip(self.patches(body), self.load.forces(), strict=True)
        return np.sum([spread(mesh, patch, force, order) for patch, (_, force) in pressed], axis=0)


def samples_in(table: pd.DataFrame) -> list[Sample]:
    """Return the samples of loads.csv, in its order."""
    loads = loads_of(table["contact"], table[FORCES].to_numpy(dtype=float))
    rows = zip(table["sample"], loads, table["radius_m"], strict=True)
    return [Sample(int(number), load, float(radius_m)) for number, load, radius_m in rows]


PEAK_TOLERANCE = 0.05
"""Relative difference from the wanted peak up to which a force counts as found."""
PRESSURE = 0.25
"""Peak pressure as a share of Young's modulus that no press exceeds, unless the regime says otherwise."""
DEEPEST = 0.15
"""Share of the body's size by which a press of a regime without peak_of_size moves it at most: slender bodies bend."""
TOLERANCE = 1e-4
"""Relative residual of the solves that the search takes: far below PEAK_TOLERANCE."""
SOUND = 0.5
"""The smallest det F that a press may reach: finer meshes reach less, and below there is no truth to compare with."""
FIRST = 0.7
"""Share of a hard press that the search tries first."""
TRIES, BRACKET = 12, 0.02
"""Most solves of a search, and the relative distance of two forces on either side of a jump at which it ends."""
LOWER, CLEAR = 0.85, 0.6
"""Factors by which a force that fails is lowered, and then the one that does not: finer meshes are softer and fail
earlier.

The thin lobe of the liver snaps at 0.19 of Young's modulus on level 1, and below 0.154 on level 2.
"""
UNCAPPED = "no"
FAILED = ("inverted", "squeezed", "unstable")
"""Reasons why a press is lowered that are limits of the body, rather than of the regime."""


@dataclass(frozen=True, eq=False)
class Trial:
    """A trial press: force [N], displacements (n, 3) [m], their peak [m], det F, and why it is ``wrong``, or ""."""

    newtons: float
    moved: np.ndarray
    peak: float
    least_det: float
    wrong: str = ""


class PressSearch:
    """Search for the force of presses on one body, by quadratic elements on the last level but one.

    regime, radius_m : as ``choose_presses`` takes them
    """

    def __init__(self, body: Body, regime: Mapping, radius_m: float):
        self._level = max(len(body.levels) - 2, 0)
        self._body = body if len(body.levels) > 1 else finer(body)
        self._solver = Unbuckled(self._body, self._level, order=2)
        self._linear = self._solver.linear_solver(1e-6)
        self._radius = radius_m
        self._free = "peak_of_size" not in regime
        self._peak = regime.get("peak_of_size", DEEPEST) * body.fine.size
        self._most = regime.get("pressure_of_young", PRESSURE) / self.pressure(1.0)

    def pressure(self, newtons: float) -> float:
        """Return the peak pressure of a force [N] as a share of Young's modulus."""
        return 2.0 * newtons / (np.pi * self._radius**2) / self._body.material.young_pa

    def volume_change(self, moved: np.ndarray) -> float:
        """Return the change of the body's volume under displacements (n, 3) [m], over its volume at rest."""
        mesh, rest = self._body.levels[self._level], self._solver.mesh.nodes
        return enclosed_volume(mesh, rest + moved) / enclosed_volume(mesh, rest) - 1.0

    def find(
        self, contact: int, direction: np.ndarray, magnitude: float, bound: float = np.inf, why: str = ""
    ) -> tuple[Trial, str]:
        """Return the press along ``direction`` (3,) at a contact with the peak of the regime times ``magnitude``.

        bound : force [N] that it may not exceed, because of ``why``
        Where that peak is not reached, it is the deepest press below. The second result is why, or UNCAPPED.
        NotConverged where no press was found. Forces are tried between those of ``below``, the hardest that holds and
        stays below the peak, and of ``above``, the gentlest that fails or exceeds it, or None.
        """
        unit_load = nodal_load(self._body, self._level, contact, direction, self._radius, order=2)
        target_peak, max_newtons = magnitude * self._peak, self._most * (magnitude if self._free else 1.0)
        limit = UNCAPPED if self._free else "pressure"
        if bound < max_newtons:
            max_newtons, limit = bound, why
        stiffness = 1.0 / peak_of(self._linear(unit_load))
        below, above = Trial(0.0, np.zeros_like(unit_load), 0.0, 1.0), None
        newtons = min(target_peak * stiffness, max_newtons)
        if newtons > self._most / 2.0:  # not at once to where the body may collapse, which takes long to find out
            newtons *= FIRST
        for _ in range(TRIES):
            trial = self._press(newtons * unit_load, newtons, below)
            if not trial.wrong and abs(trial.peak / target_peak - 1.0) <= PEAK_TOLERANCE:
                if self._free:
                    return trial, "peak" if newtons < max_newtons else limit
                return trial, UNCAPPED
            if not trial.wrong and trial.peak < target_peak:
                below = trial
                if newtons >= max_newtons:
                    return below, limit
            else:
                above = trial
            if above is not None and below.newtons > (0.99 * LOWER if above.wrong else 1.0 - BRACKET) * above.newtons:
                break
            newtons = _next_force(below, above, target_peak, stiffness, max_newtons)
        if not below.newtons:
            raise NotConverged(
                f"{self._body.name}, contact {contact}: no press was found at which all elements keep their shape; "
                "lower the regime's peak_of_size or pressure_of_young, or give a larger radius_m.",
                [],
            )
        gentler = self._press(CLEAR * below.newtons * unit_load, CLEAR * below.newtons, below)
        below = below if gentler.wrong else gentler
        return below, (above.wrong if above is not None else "") or "unstable"

    def _press(self, load: np.ndarray, newtons: float, below: Trial) -> Trial:
        """Solve for a ``load`` of so many newtons, from the displacements of the press ``below`` in proportion."""
        rest = self._solver.mesh.nodes
        start = rest + below.moved * (newtons / below.newtons) if below.newtons > 0.0 else None
        try:
            positions = self._solver.solve(load, TOLERANCE, start=start).x
        except NotConverged:
            return Trial(newtons, below.moved, np.inf, -np.inf, "unstable")
        least_det = self._solver.least_det(positions)
        failure = "" if least_det >= SOUND else "squeezed" if least_det > 0.0 else "inverted"
        return Trial(newtons, positions - rest, peak_of(positions - rest), least_det, failure)


def _next_force(below: Trial, above: Trial | None, target_peak: float, stiffness: float, max_newtons: float) -> float:
    """Return the next force to try [N] to reach ``target_peak`` [m]; ``below`` and ``above`` bracket it as in ``find``.

    Force over peak is nearly linear in the peak, from ``stiffness`` [N/m] at rest: a line through two ``points``.
    """
    sound = [press for press in (below, above) if press is not None and press.peak > 0.0 and not press.wrong]
    points = [(0.0, stiffness), *((press.peak, press.newtons / press.peak) for press in sound)]
    if len(points) == 1:
        return 0.5 * max_newtons if above is None else 0.5 * above.newtons
    (peak_1, stiffness_1), (peak_2, stiffness_2) = points[-2:]
    newtons = target_peak * (stiffness_1 + (stiffness_2 - stiffness_1) * (target_peak - peak_1) / (peak_2 - peak_1))
    smallest = (1.0 + BRACKET / 2.0) * below.newtons
    largest = max_newtons
    if above is not None:
        largest = LOWER * above.newtons if above.wrong else above.newtons - (above.newtons - below.newtons) / 8.0
    # a step beyond twice the force of a known press is a guess
    return float(np.clip(newtons, smallest, min(largest, 2.0 * below.newtons) if below.newtons else largest))


MOST_OF_SIZE = 0.5
"""Share of the body's size that the radius of a press may have."""
PRESS_COLUMNS = [
    *LOAD_COLUMNS, "magnitude", "tilt_degrees", "peak_of_size", "pressure_of_young", "least_det", "volume_change",
    "capped",
]  # fmt: skip
"""Columns of the table; ``volume_change`` is over the body's volume at rest."""


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
    """Return the table of all ``presses`` at each of ``contacts_count`` contacts, which ``sampled_contacts`` chooses.

    also : coarse nodes that are pressed besides
    presses : each with ``magnitude``, and ``tilt_degrees`` from the inward normal, towards a seeded random side
    regime : ``peak_of_size``, the peak of a press of magnitude 1 over the body's size; ``pressure_of_young``, the
        largest peak pressure 2 F / (π radius²) of any press over Young's modulus, by default PRESSURE. Without
        peak_of_size a press of magnitude 1 has that pressure, or a peak of DEEPEST.

    Forces are found to PEAK_TOLERANCE with quadratic elements on the last level but one, whose nodes are those of the
    finest. A press is lowered where an element is inverted, or squeezed below SOUND, or the body collapses; presses of
    smaller magnitude at that contact are then lowered in proportion. The column ``capped`` is "no", or for a lowered
    press "pressure", "peak", "inverted", "squeezed" or "unstable"; a warning says how many are.

    Raises InputError for a radius that ``check_radius`` refuses, and where fewer contacts can be pressed; NotConverged
    if a force is not found.
    """
    check_radius(body, radius_m)
    contacts = _contacts(body, contacts_count, also, seed)
    search = PressSearch(body, regime, radius_m)
    sides = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, (len(contacts), len(presses)))
    rows: list[list] = []
    for contact, side_angles in progress(list(zip(contacts, sides, strict=True))):
        directions = [
            oblique(body.fine.normals[contact], press["tilt_degrees"], angle)
            for press, angle in zip(presses, side_angles, strict=True)
        ]
        trials = _in_order(search, int(contact), directions, [press["magnitude"] for press in presses])
        for press, direction, (trial, capped) in zip(presses, directions, trials, strict=True):
            load_columns = [len(rows), int(contact), *(trial.newtons * direction), radius_m]
            found_columns: list = [trial.peak / body.fine.size, search.pressure(trial.newtons), trial.least_det]
            found_columns += [search.volume_change(trial.moved), capped]
            rows.append([*load_columns, press["magnitude"], press["tilt_degrees"], *found_columns])
    table = pd.DataFrame(rows, columns=PRESS_COLUMNS)
    _warn(body.name, table["capped"], regime.get("pressure_of_young", PRESSURE))
    return table


def _contacts(body: Body, count: int | None, also: Sequence[int], seed: int) -> np.ndarray:
    """Return ``count`` contacts, None for all, and those of ``also``; InputError if fewer can be pressed."""
    contacts = sampled_contacts(body, count, seed) if count != 0 else np.empty(0, dtype=np.int64)
    if count is not None and len(contacts) < count:
        raise InputError(
            f"bodies.{body.name}: {count} contacts are asked for and {len(contacts)} can be pressed; "
            "lower contacts, or hold less of the body."
        )
    return np.append(contacts, np.setdiff1d(also, contacts)).astype(np.int64)


def check_radius(body: Body, radius_m: float) -> None:
    """Raise InputError for a disc without a radius, or with one above half the body's size, as by another unit."""
    size = body.fine.size
    if not 0.0 < radius_m <= MOST_OF_SIZE * size:
        remedy = "a press needs a disc" if radius_m <= 0.0 else f"the body's longest side is {size:.3g} m"
        millimetres = f", such as {1e-3 * radius_m:g} for millimetres" if 1e-3 * radius_m <= MOST_OF_SIZE * size else ""
        raise InputError(
            f"bodies.{body.name}: radius_m is {radius_m:g}, and {remedy}; give a radius in m of at most half of the "
            f"longest side{millimetres if radius_m > 0.0 else ''} (radius_m or radius_of_body_m of a regime)."
        )


def _in_order(
    search: PressSearch, contact: int, directions: Sequence[np.ndarray], magnitudes: Sequence[float]
) -> list[tuple[Trial, str]]:
    """Find the presses of one contact, the hardest first: one that is lowered bounds the gentler ones in proportion.

    Trap: without a bound a gentler press may be found at a force at which a harder one has failed, beyond a snap.
    """
    trials: dict[int, tuple[Trial, str]] = {}
    for i in sorted(range(len(magnitudes)), key=lambda i: -magnitudes[i]):
        bounds = [
            (press.newtons * magnitudes[i] / magnitudes[j], why)
            for j, (press, why) in trials.items()
            if why in FAILED and magnitudes[j] > magnitudes[i]
        ]
        trials[i] = search.find(contact, directions[i], magnitudes[i], *min(bounds, default=()))
    return [trials[i] for i in range(len(magnitudes))]


def oblique(normal: np.ndarray, tilt_degrees: float, side: float) -> np.ndarray:
    """Return the inward unit vector (3,), tilted off the outward ``normal``'s axis towards the angle ``side`` [rad]."""
    tangent_axis = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    tangent_axis /= np.linalg.norm(tangent_axis)
    tangent = np.cos(side) * tangent_axis + np.sin(side) * np.cross(normal, tangent_axis)
    tilt = np.radians(tilt_degrees)
    return np.sin(tilt) * tangent - np.cos(tilt) * normal


def _warn(name: str, capped: pd.Series, pressure: float) -> None:
    """Warn of presses that are lowered; capped : the reason of each; pressure : the regime's over Young's modulus."""
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
            warnings.warn(
                f"bodies.{name}: {counts[reason]} of {len(capped)} presses are lowered, as they {words}.", stacklevel=3
            )
