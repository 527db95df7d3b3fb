"""Presses that were measured: force over depth, and over time, at places of a body; reading them from CSV.

docs/add-a-measurement.md has the columns. Rows before contact, of negative depths, give the sensor's zero and its slope
over depth, which are subtracted.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from palpate.effects.instrument import SPHERE, Instrument
from palpate.errors import InputError
from palpate.identification.baseline import line_before
from palpate.identification.press_table import AT, NAMES, VECTORS, read_table


@dataclass(frozen=True, eq=False)
class Press:
    """One press of an instrument into tissue, as it was measured in k samples.

    place, session, specimen : names, empty if unknown; presses that share all three are repeats
    at_m : (3,) place of first touch [m]; direction : (3,) unit vector into the tissue; None if they are not known
    time_s : (k,) [s], which increases, or None; depth_m : (k,) displacement of the instrument since first touch [m]
    force_n : (k,) [N], positive where it presses; noise and a drifting zero may make some negative
    thickness_m : of the slab there [m], or None
    """

    name: str
    place: str
    session: str
    specimen: str
    at_m: np.ndarray | None
    direction: np.ndarray | None
    time_s: np.ndarray | None
    depth_m: np.ndarray
    force_n: np.ndarray
    thickness_m: float | None = None


@dataclass(frozen=True, eq=False)
class PressRecords:
    """Presses by one ``instrument``, None if it is not known, and the file ``source`` that they are from.

    found : sentences on how the file was read
    force_error : standard deviation of the relative error that all forces have in common, by the sensor's slope
    """

    instrument: Instrument | None
    presses: tuple[Press, ...]
    source: str
    found: tuple[str, ...] = ()
    force_error: float = 0.0

    @property
    def ball_m(self) -> float | None:
        """The radius of a ball [m], None for other instruments."""
        return self.instrument.radius_m if self.instrument and self.instrument.kind == SPHERE else None


LEAST_POINTS = 5
"""Fewest points of a press: offsets of depth and force, a modulus and an exponent are fitted to them."""
UNEVEN = 0.02
"""Share of a press's largest depth by which depth may decrease from a row to the next without being a withdrawal."""
DEEPEST_M, DEEPEST_RADII = 0.5, 10.0
"""Depths [m], and of a ball in radii, that no press of an organ reaches: they are in other units."""
LARGEST_M, LEAST_RADII, FEW_RADII = 0.1, 1e-3, 0.03
"""Radius of a ball [m] above which, and depths in radii below which, one of them is in another unit, or may be."""
STIFFEST_PA, SOFTEST_PA = 3e7, 1.0
"""Moduli of no soft tissue: cartilage and skin have less than 30 MPa, a body of 1 Pa flows off the table."""
USUAL_PA = (100.0, 1e5)
"""Moduli of organs: brain and fat have some hundred Pa, the stiffest livers that elastography knows 75 kPa. Beyond is
cartilage, tendon and skin, or another unit: grams make 2 kPa 200 kPa."""
FIRST, STICKS = 0.08, 0.005
"""Share of the largest depth after first touch in which adhesion shows, and of the largest force that it has there."""
UNLIKE = 90.0
"""Factor between moduli of presses that another unit makes, grams by 102, rather than tissue."""
PULLS = 0.5
"""Share of the largest force of the middle press by which a force may be negative, by noise or a drifting zero."""


def read_presses(
    path: str | Path,
    instrument: Instrument | None = None,
    columns: Mapping[str, str | Sequence[str]] | None = None,
    names: str = "",
    leave_out: Sequence[str] = (),
    size_m: float | None = None,
) -> PressRecords:
    """Read the presses of a CSV file, in the order of the file.

    columns, leave_out : as ``read_table`` has them
    names : a regular expression with groups ``session``, ``specimen`` or ``place``, that the name of a press
        holds; what they find is put in capitals
    size_m : thickness of the slab or size of the body [m], which the instrument and depths have to fit
    Raises InputError, naming file, row or column and remedy, for what is no press or in other units. Units are known by
    the column's name, or by depths that no organ has and moduli that no tissue has; forces without an instrument are
    known by neither, and their unit does not matter to relaxation.
    """
    path = str(path)
    table, separated = read_table(path, columns or {}, leave_out)
    if names:
        table = _with_named_parts(table, names, path)
    presses = tuple(_press(rows, path) for rows in list(_rows_of_presses(table, path)))
    remarks = () if separated == "commas" else (f"{path}: cells are separated by {separated}",)
    records = _without_baseline(PressRecords(instrument, _places(presses), path, remarks))
    check_units(records, size_m)
    return records


def _without_baseline(records: PressRecords) -> PressRecords:
    """Subtract the sensor's zero and slope from all forces, which rows before contact show, if any press has them.

    For a press without such rows they are the medians of the others.
    """
    ends = [int(press.depth_m.argmax()) + 1 for press in records.presses]
    lines = [
        line_before(press.depth_m[:end], press.force_n[:end]) for press, end in zip(records.presses, ends, strict=True)
    ]
    fits = [line for line in lines if line is not None]
    if not fits:
        return records
    median, presses, errors = np.median(fits, axis=0), [], []
    for press, end, line in zip(records.presses, ends, lines, strict=True):
        zero, slope, error_of_slope = median if line is None else line
        force, half_depth = press.force_n - zero - slope * press.depth_m, 0.5 * press.depth_m[end - 1]
        if line is not None:
            force_there = np.interp(half_depth, press.depth_m[:end], force[:end])
            errors.append(error_of_slope * half_depth / max(abs(force_there), 1e-300))
        presses.append(replace(press, force_n=force))
    note = ", the median where a press has none of its own" if len(fits) < len(lines) else ""
    text = (
        f"{records.source}: {len(fits)} of {len(presses)} presses have rows before contact; their line, in the median "
        f"{1e3 * median[0]:.3g} mN at depth 0 and {median[1]:.3g} mN/mm (± {median[2]:.2g}), is subtracted from all "
        f"forces{note}"
    )
    common = float(np.median(errors) / np.sqrt(len(errors)))
    return replace(records, presses=tuple(presses), found=(*records.found, text), force_error=common)


def join(records: Sequence[PressRecords]) -> PressRecords:
    """Return the presses of several files by the same instrument; InputError for a name that two of them have."""
    source_of: dict[str, str] = {}
    for part, press in [(each, press) for each in records for press in each.presses]:
        if press.name in source_of:
            raise InputError(
                f"{part.source} and {source_of[press.name]} both have a press {press.name}; rename one of them."
            )
        source_of[press.name] = part.source
    return PressRecords(
        records[0].instrument, tuple(press for part in records for press in part.presses),
        ", ".join(part.source for part in records), tuple(line for part in records for line in part.found),
        max(part.force_error for part in records),
    )  # fmt: skip


def doubts(records: PressRecords) -> Iterator[str]:
    """Yield a sentence for each oddity of presses: forces that fall or pull, small depths, moduli of no organ."""
    if flat := [press.name for press in records.presses if not _rises(press)]:
        yield (
            f"{records.source}: the force does not rise with depth in {len(flat)} of {len(records.presses)} presses "
            f"({_some(flat)}); see whether they touch the tissue."
        )
    at_first_touch = [
        press.force_n[(press.depth_m > 0.0) & (press.depth_m <= FIRST * press.depth_m.max())]
        for press in records.presses
    ]
    first_forces = [float(forces.mean()) for forces in at_first_touch if len(forces)]
    largest_force = np.median([press.force_n.max() for press in records.presses])
    if first_forces and np.median(first_forces) < -STICKS * largest_force:
        yield (
            f"{records.source}: after first touch forces are negative ({1e3 * np.median(first_forces):.2g} mN in the "
            "middle press): tissue that sticks pulls, which no law here does, or the zero is wrong; E may leave its "
            "interval."
        )
    if (ball := records.ball_m) is None:
        return
    if (deepest := max(float(press.depth_m.max()) for press in records.presses)) < FEW_RADII * ball:
        yield (
            f"{records.source}: the deepest press reaches {deepest:g} m, {deepest / ball:.2g} radii of the ball "
            f"({ball:g} m); see whether both are in metres, or give the ball's unit (sphere:4mm)."
        )
    moduli = _hertz_moduli(records, ball)
    modulus = float(np.median(moduli))
    unlike = (moduli >= UNLIKE * modulus) | (moduli <= modulus / UNLIKE)
    if names := [records.presses[i].name for i in np.flatnonzero(unlike) if _rises(records.presses[i])]:
        yield (
            f"{records.source}: {_some(names)} of {len(records.presses)} presses are {UNLIKE:g} times as stiff or soft "
            "as the middle one, or more; see whether all are in newtons and metres."
        )
    if not USUAL_PA[0] < modulus < USUAL_PA[1]:
        softer, usual = ("softer", USUAL_PA[0]) if modulus < USUAL_PA[0] else ("stiffer", USUAL_PA[1])
        yield (
            f"{records.source}: force_n over depth_m is that of a modulus of {modulus:.2g} Pa, {softer} than the "
            f"{usual:g} Pa that organs reach; see whether forces are newtons (grams times 0.00981), depths and "
            "radius metres."
        )


def _with_named_parts(table: pd.DataFrame, names: str, path: str) -> pd.DataFrame:
    """Add columns of session, specimen or place to the table, by the groups of the regular expression ``names``.

    It searches the names of presses. InputError for one without such groups, or that a name does not fit.
    """
    try:
        pattern = re.compile(names)
    except re.error as error:
        raise InputError(f"names is {names}, which is no regular expression ({error}); correct it.") from error
    if not pattern.groupindex or not set(pattern.groupindex) <= set(NAMES):
        raise InputError(f"names is {names}; give it named groups, (?P<session>…), out of {', '.join(NAMES)}.")
    matches = table["press"].map(pattern.search)
    if (lost := table["press"][matches.isna()]).size:
        raise InputError(
            f"{path}: the press {lost.iloc[0]} has a name without what names, {names}, looks for; correct it."
        )
    return table.assign(**{key: [match.groupdict("")[key].upper() for match in matches] for key in pattern.groupindex})


def _rows_of_presses(table: pd.DataFrame, path: str) -> Iterator[pd.DataFrame]:
    """Yield the rows of each press, with the lines of the file as index; InputError for a name in two places."""
    run = table["press"].ne(table["press"].shift()).cumsum()
    seen: set[str] = set()
    for _, rows in table.groupby(run, sort=False):
        name = rows["press"].iloc[0]
        if name in seen:
            raise InputError(
                f"{path}, row {rows.index[0]}: the press {name} stands above already, with others between; give each "
                "press a name of its own, and its rows one after another."
            )
        seen.add(name)
        yield rows


def _press(rows: pd.DataFrame, path: str) -> Press:
    """Return the press of ``rows`` of a file; InputError for rows that cannot be of one press."""
    lines, first = rows.index, rows.iloc[0]
    name, label = first["press"], f"{path}: the press {first['press']}"
    if len(rows) < LEAST_POINTS:
        raise InputError(f"{label} has {len(rows)} points, fewer than {LEAST_POINTS}; measure more, or leave it out.")
    for column in ("thickness_m", *AT, *VECTORS["direction"], *VECTORS["normal"], *NAMES):
        if column in rows and len(unlike := lines[rows[column] != first[column]]):
            raise InputError(
                f"{path}, row {unlike[0]}: {column} of the press {name} differs from that in the row above; give two "
                "presses two names."
            )
    depth, force = rows["depth_m"].to_numpy(), rows["force_n"].to_numpy()
    time = rows["time_s"].to_numpy() if "time_s" in rows else None
    if not depth.max() > 0.0:
        raise InputError(
            f"{label} is nowhere deeper than {depth.max() + 0.0:g} m; give depth_m as the way into the tissue since "
            "first touch, or name the press under leave_out."
        )
    back = np.flatnonzero(np.diff(depth) < -UNEVEN * depth.max())
    if time is None and len(back):
        raise InputError(
            f"{path}, row {lines[back[0] + 1]}: depth_m falls from {depth[back[0]]:g} to {depth[back[0] + 1]:g} m in "
            f"the press {name}; keep the way down only, give time_s, or give two presses two names."
        )
    if time is not None and len(stops := np.flatnonzero(np.diff(time) <= 0.0)):
        raise InputError(
            f"{path}, row {lines[stops[0] + 1]}: time_s of the press {name} goes from {time[stops[0]]:g} to "
            f"{time[stops[0] + 1]:g} s; sort its rows by time, or give two presses two names."
        )
    point = first[list(AT)].to_numpy(dtype=float) if AT[0] in rows else None
    direction = None
    for group, sign in (("direction", 1.0), ("normal", -1.0)):
        if VECTORS[group][0] in rows:
            vector = sign * first[list(VECTORS[group])].to_numpy(dtype=float)
            length = float(np.linalg.norm(vector))
            if not length > 0.0:
                raise InputError(f"{label} has the direction 0 0 0; give the way of the instrument.")
            direction = vector / length
    return Press(
        name, at_m=point, direction=direction, time_s=time, depth_m=depth, force_n=force,
        thickness_m=float(first["thickness_m"]) if "thickness_m" in rows else None,
        **{column: first.get(column, "").strip() for column in NAMES},
    )  # fmt: skip


def _places(presses: Sequence[Press]) -> tuple[Press, ...]:
    """Name the places of presses without one: by the first press at the same coordinates, else by the press itself."""
    first_press_at: dict[tuple, str] = {}
    placed = []
    for press in presses:
        key: tuple = (press.name,) if press.at_m is None else (press.specimen, *press.at_m)
        placed.append(replace(press, place=press.place or first_press_at.setdefault(key, press.name)))
    return tuple(placed)


def _slope(press: Press) -> float:
    """Return the slope [N/m] of the line fitted to force over depth; 0 for a depth that is always the same."""
    away = press.depth_m - press.depth_m.mean()
    return float(away @ press.force_n / max(away @ away, 1e-300))


def _rises(press: Press) -> bool:
    """Whether the force rises by more than rounding."""
    return _slope(press) * float(np.ptp(press.depth_m)) > 1e-9 * float(np.abs(press.force_n).max())


def check_units(records: PressRecords, size_m: float | None) -> None:
    """Raise InputError for depths, forces or an instrument in other units; size_m : of what is pressed [m], or None."""
    path, presses, ball = records.source, records.presses, records.ball_m
    deepest = max(presses, key=lambda press: press.depth_m.max())
    depth = float(deepest.depth_m.max())
    limits = [(DEEPEST_M, "deeper than any organ")]
    limits += [(size_m, f"and what it presses is {size_m:g} m thick")] if size_m is not None else []
    if ball is not None:
        limits.append((DEEPEST_RADII * ball, f"{depth / ball:.3g} radii of the instrument ({ball:g} m)"))
        if depth < LEAST_RADII * ball or ball > LARGEST_M:
            raise InputError(
                f"{path}: the ball has a radius of {ball:g} m, and the deepest press reaches {depth:g} m; give both in "
                "metres, or the ball with its unit, such as sphere:4mm."
            )
    for limit, words in limits:
        if depth > limit:
            raise InputError(
                f"{path}: the press {deepest.name} reaches a depth_m of {depth:g} m, {words}; give metres (millimetres "
                "times 0.001)."
            )
    thick = max((press.thickness_m for press in presses if press.thickness_m is not None), default=depth)
    if not 0.0 < thick <= DEEPEST_M:
        raise InputError(f"{path}: a press has a thickness_m of {thick:g} m; give metres (millimetres times 0.001).")
    peak = float(np.median([press.force_n.max() for press in presses]))
    if np.median([_slope(press) for press in presses]) < 0.0:
        raise InputError(f"{path}: force_n falls with depth in most presses; give forces positive where one presses.")
    for press in presses:
        if press.force_n.min() < -PULLS * abs(peak):
            raise InputError(
                f"{path}: the press {press.name} has a force_n of {press.force_n.min():g} N, where the middle press "
                f"reaches {peak:g} N; subtract the zero of the sensor, and leave out what pulls."
            )
    if ball is not None and not SOFTEST_PA < (modulus := float(np.median(_hertz_moduli(records, ball)))) < STIFFEST_PA:
        raise InputError(
            f"{path}: force_n over depth_m is that of a modulus of {modulus:.2g} Pa, of no soft tissue; give newtons "
            "(grams times 0.00981, millinewtons times 0.001), metres, and the instrument's radius in metres."
        )


def _hertz_moduli(records: PressRecords, radius_m: float) -> np.ndarray:
    """Return Young's modulus of each press, (presses,) [Pa], by Hertz's formula at the largest depth and ν = 0.5."""
    deepest = [(press.depth_m.max(), press.force_n[press.depth_m.argmax()]) for press in records.presses]
    return np.array([9.0 * force / (16.0 * np.sqrt(radius_m) * depth**1.5) for depth, force in deepest])


def _some(names: Sequence[str]) -> str:
    return ", ".join(names[:3]) + " …" * (len(names) > 3)
