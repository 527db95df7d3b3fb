"""Presses that were measured: force over depth, and over time, at places of a body; reading them from CSV.

A file has a row a point, and these columns; docs/add-a-measurement.md shows one.

    press                             name of the press that the row belongs to
    depth_m force_n                   way of the instrument into the tissue since first touch [m], and force [N],
                                      positive where it presses
    time_s                            optional; without it the rows of a press are in the order of rising depth
    x_m y_m z_m                       optional: place of first touch, the same in all rows of a press [m]
    direction_x direction_y direction_z  optional: where the instrument moves, into the tissue; or, instead,
    normal_x normal_y normal_z        the outward normal of the surface, against which it moves
    thickness_m                       optional: of the tissue between the instrument and what it lies on [m]
    place session specimen            optional: names; presses at one place (x_m y_m z_m) are repeats there
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from palpate.effects.instrument import Instrument
from palpate.errors import InputError, suggest


@dataclass(frozen=True, eq=False)
class Press:
    """One press of an instrument into tissue.

    place, session, specimen : names, empty if unknown; presses that share all three are repeats
    at_m : (3,) place of first touch [m]; direction : (3,) unit vector into the tissue; None if they are not known
    time_s : (k,) [s], which increases, or None; depth_m : (k,) way since first touch [m]
    force_n : (k,) [N], positive where it presses; noise and a drifting zero may make some negative
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
    """Presses by one instrument, None if it is not known, and the file ``source`` that they are from."""

    instrument: Instrument | None
    presses: tuple[Press, ...]
    source: str


NEEDED, NAMES = ("press", "depth_m", "force_n"), ("place", "session", "specimen")
VECTORS = {name: tuple(f"{name}_{axis}" for axis in "xyz") for name in ("direction", "normal")}
AT = ("x_m", "y_m", "z_m")
COLUMNS = (*NEEDED, "time_s", "thickness_m", *AT, *VECTORS["direction"], *VECTORS["normal"], *NAMES)
"""The columns that are read; others are ignored."""

LEAST_POINTS = 5
"""Fewest points of a press: offsets of depth and force, a modulus and an exponent are fitted to them."""
UNEVEN = 0.02
"""Share of a press's largest depth by which depth may decrease from a row to the next without being a withdrawal."""
DEEPEST_M, DEEPEST_RADII = 0.5, 10.0
"""Depths [m], and of a ball in radii, that no press of an organ reaches: they are in other units."""
STIFFEST_PA, SOFTEST_PA = 3e7, 1.0
"""Moduli of no soft tissue: cartilage and skin have less than 30 MPa, a body of 1 Pa flows off the table."""
USUAL_PA = (100.0, 1e5)
"""Moduli of organs: brain and fat have some hundred Pa, the stiffest livers that elastography knows 75 kPa. Beyond is
cartilage, tendon and skin, or another unit: grams make 2 kPa 200 kPa."""
PULLS = 0.5
"""Share of the largest force of the middle press by which a force may be negative, by noise or a drifting zero."""


def read_presses(
    path: str | Path,
    instrument: Instrument | None = None,
    columns: Mapping[str, str | Sequence[str]] | None = None,
    names: str = "",
    leave_out: Sequence[str] = (),
    least_points: int = LEAST_POINTS,
    size_m: float | None = None,
) -> PressRecords:
    """Read the presses of a CSV file, in the order of the file.

    columns : names that the file has for COLUMNS; of several, the cells are joined by a space
    names : a regular expression with groups ``session``, ``specimen`` or ``place``, that the name of a press
        holds; what they find is put in capitals
    leave_out : names of presses that are not read
    size_m : thickness of the slab or size of the body [m], which the instrument and depths have to fit
    Raises InputError, naming file, row or column and remedy, for what is no press or in other units. Units are known by
    the column's name, or by depths that no organ has and moduli that no tissue has; forces without an instrument are
    known by neither, and their unit does not matter to relaxation.
    """
    path, table = str(path), _table(path)
    table = _renamed(table, columns or {}, path)
    _check_columns(table, path)
    table = table[~table["press"].isin(list(leave_out))].copy()
    if table.empty:
        raise InputError(f"{path} has no press that leave_out does not name; name fewer.")
    _check_cells(table, path)
    if names:
        table = _named(table, names, path)
    presses = tuple(_press(*run, least_points, path) for run in list(_runs(table, path)))
    records = PressRecords(instrument, _places(presses), path)
    _check_units(records, size_m)
    return records


def join(records: Sequence[PressRecords]) -> PressRecords:
    """Return the presses of several files by the same instrument; InputError for a name that two of them have."""
    owner: dict[str, str] = {}
    for part in records:
        for press in part.presses:
            if press.name in owner:
                raise InputError(
                    f"{part.source} and {owner[press.name]} both have a press {press.name}; rename one of them."
                )
        owner |= dict.fromkeys((press.name for press in part.presses), part.source)
    presses = tuple(press for part in records for press in part.presses)
    return PressRecords(records[0].instrument, presses, ", ".join(part.source for part in records))


def doubts(records: PressRecords) -> Iterator[str]:
    """Yield a sentence for what can be read and is hardly meant: presses of nothing, moduli of no organ."""
    weak = [press.name for press in records.presses if not _rises(press)]
    if weak:
        named = ", ".join(weak[:3]) + (" …" if len(weak) > 3 else "")
        yield (
            f"{records.source}: the force does not rise with depth in {len(weak)} of {len(records.presses)} presses "
            f"({named}); see whether they touch the tissue."
        )
    if records.instrument is not None:
        modulus = _hertz_modulus(records, records.instrument.radius_m)
        if not USUAL_PA[0] < modulus < USUAL_PA[1]:
            softer, usual = ("softer", USUAL_PA[0]) if modulus < USUAL_PA[0] else ("stiffer", USUAL_PA[1])
            yield (
                f"{records.source}: force_n over depth_m is that of a modulus of {modulus:.2g} Pa, {softer} than the "
                f"{usual:g} Pa that organs reach; see whether forces are newtons (grams times 0.00981), depths and "
                "radius metres."
            )


def _table(path: str | Path) -> pd.DataFrame:
    """Read all cells as text, with the row of the file [1 is the header] as the index."""
    try:
        table = pd.read_csv(path, dtype=str, keep_default_na=False, skipinitialspace=True)
    except (OSError, pd.errors.ParserError, pd.errors.EmptyDataError, UnicodeDecodeError) as error:
        raise InputError(f"{path} is no table ({' '.join(str(error).split())}); give a CSV file.") from error
    table.columns = [str(name).strip() for name in table.columns]
    table.index = pd.RangeIndex(2, len(table) + 2)
    if table.empty:
        raise InputError(f"{path} has no rows; give a row for each point of a press.")
    return table


def _renamed(table: pd.DataFrame, columns: Mapping[str, str | Sequence[str]], path: str) -> pd.DataFrame:
    """Return the table with a column for each entry of ``columns``; InputError for one that is not there."""
    found = table.copy()
    for name, of in columns.items():
        if name not in COLUMNS:
            raise InputError(f"columns has {name}, which no press has; {suggest(name, list(COLUMNS), 'choose from')}")
        sources = [of] if isinstance(of, str) else list(of)
        for source in sources:
            if source not in table:
                near = suggest(source, list(table.columns), "it has")
                raise InputError(f"{path} lacks the column {source}, which columns.{name} names; {near}")
        found[name] = table[sources].agg(" ".join, axis=1) if len(sources) > 1 else table[sources[0]]
    return found


def _check_columns(table: pd.DataFrame, path: str) -> None:
    for column in NEEDED:
        if column not in table:
            stem = column.partition("_")[0]
            near = [name for name in table.columns if name.lower().startswith(stem)]
            if near and "_" in column:
                unit = "metres" if stem == "depth" else "newtons"
                raise InputError(
                    f"{path} has {near[0]} and lacks {column}; convert it to {unit} and call it {column}, or name it "
                    "by columns (--column) if it is in them."
                )
            raise InputError(
                f"{path} lacks the column {column}; give {', '.join(NEEDED)}, or name them by columns (--column)."
            )
    for group in (AT, *VECTORS.values()):
        there = [name for name in group if name in table]
        if there and len(there) < 3:
            raise InputError(f"{path} has {there[0]} and not all of {', '.join(group)}; give all three or none.")
    if all(name in table for name in (*VECTORS["direction"], *VECTORS["normal"])):
        raise InputError(f"{path} has directions and normals; leave one of them out.")
    for group in VECTORS.values():
        if group[0] in table and AT[0] not in table:
            raise InputError(f"{path} has {group[0]} and no places; give {', '.join(AT)}, or leave it out.")


def _check_cells(table: pd.DataFrame, path: str) -> None:
    """Turn what has to be numbers into such, in place; InputError for an empty or other cell."""
    for column in COLUMNS:
        if column not in table or column in ("press", *NAMES):
            continue
        texts = table[column].str.strip()
        numbers = pd.to_numeric(texts, errors="coerce").astype(float)
        wrong = numbers.index[~np.isfinite(numbers)]
        optional = column not in NEEDED and column != "time_s"
        if len(wrong) and optional and texts[wrong].eq("").all():
            bare = dict.fromkeys(table.loc[wrong, "press"])
            raise InputError(
                f"{path}, row {wrong[0]}: {column} is empty, and other rows have it; give the places and directions of "
                f"all presses, or of none ({len(bare)} of {table['press'].nunique()} lack some)."
            )
        if len(wrong):
            cell = table.at[wrong[0], column]
            raise InputError(
                f"{path}, row {wrong[0]}: {column} is {cell if cell.strip() else 'empty'}, which is no number; "
                "correct it or leave the row out."
            )
        table[column] = numbers
    if (empty := table.index[table["press"].str.strip().eq("")]).size:
        raise InputError(f"{path}, row {empty[0]}: press is empty; give the name of the press that the row belongs to.")


def _named(table: pd.DataFrame, names: str, path: str) -> pd.DataFrame:
    """Return the table with the session, specimen or place that the name of each press holds."""
    try:
        pattern = re.compile(names)
    except re.error as error:
        raise InputError(f"names is {names}, which is no regular expression ({error}); correct it.") from error
    if not pattern.groupindex or not set(pattern.groupindex) <= set(NAMES):
        raise InputError(f"names is {names}; give it named groups, (?P<session>…), out of {', '.join(NAMES)}.")
    found = {}
    for name in dict.fromkeys(table["press"]):
        match = pattern.search(name)
        if match is None:
            raise InputError(f"{path}: the press {name} has a name without what names, {names}, looks for; correct it.")
        found[name] = {key: word.upper() for key, word in match.groupdict(default="").items()}
    return table.assign(**{key: [found[name][key] for name in table["press"]] for key in pattern.groupindex})


def _runs(table: pd.DataFrame, path: str) -> Iterator[tuple[str, pd.Index, dict[str, np.ndarray]]]:
    """Yield name, rows and cells of each press; InputError for a name that stands in two places of the file."""
    cells = {column: table[column].to_numpy() for column in COLUMNS if column in table}
    starts = np.flatnonzero(table["press"].ne(table["press"].shift()))
    seen: set[str] = set()
    for begin, end in zip(starts, [*starts[1:], len(table)], strict=True):
        name, rows = str(cells["press"][begin]), table.index[begin:end]
        if name in seen:
            raise InputError(
                f"{path}, row {rows[0]}: the press {name} stands above already, with others between; give each press a "
                "name of its own, and its rows one after another."
            )
        seen.add(name)
        yield name, rows, {column: values[begin:end] for column, values in cells.items()}


def _press(name: str, rows: pd.Index, cells: Mapping[str, np.ndarray], least_points: int, path: str) -> Press:
    place = f"{path}: the press {name}"
    if len(rows) < least_points:
        raise InputError(f"{place} has {len(rows)} points, fewer than {least_points}; measure more, or leave it out.")
    for column in ("thickness_m", *AT, *VECTORS["direction"], *VECTORS["normal"], *NAMES):
        if column in cells and len(other := rows[cells[column] != cells[column][0]]):
            raise InputError(
                f"{path}, row {other[0]}: {column} of the press {name} differs from that in the row above; give two "
                "presses two names."
            )
    depth, force = np.array(cells["depth_m"], dtype=float), np.array(cells["force_n"], dtype=float)
    time = np.array(cells["time_s"], dtype=float) if "time_s" in cells else None
    if not depth.max() > 0.0:
        raise InputError(
            f"{place} is nowhere deeper than {depth.max() + 0.0:g} m; give depth_m as the way into the tissue since "
            "first touch, or name the press under leave_out."
        )
    back = np.flatnonzero(np.diff(depth) < -UNEVEN * depth.max())
    if time is None and len(back):
        raise InputError(
            f"{path}, row {rows[back[0] + 1]}: depth_m falls from {depth[back[0]]:g} to {depth[back[0] + 1]:g} m in "
            f"the press {name}; keep the way down only, give time_s, or give two presses two names."
        )
    if time is not None and len(still := np.flatnonzero(np.diff(time) <= 0.0)):
        raise InputError(
            f"{path}, row {rows[still[0] + 1]}: time_s of the press {name} goes from {time[still[0]]:g} to "
            f"{time[still[0] + 1]:g} s; sort its rows by time, or give two presses two names."
        )
    at = np.array([cells[column][0] for column in AT], dtype=float) if AT[0] in cells else None
    thickness = float(cells["thickness_m"][0]) if "thickness_m" in cells else None
    words = {column: str(cells[column][0]).strip() if column in cells else "" for column in NAMES}
    return Press(
        name, at_m=at, direction=_direction(cells, place), time_s=time, depth_m=depth, force_n=force,
        thickness_m=thickness, **words,
    )  # fmt: skip


def _direction(cells: Mapping[str, np.ndarray], place: str) -> np.ndarray | None:
    for group, sign in ((VECTORS["direction"], 1.0), (VECTORS["normal"], -1.0)):
        if group[0] in cells:
            vector = sign * np.array([cells[column][0] for column in group], dtype=float)
            length = float(np.linalg.norm(vector))
            if not length > 0.0:
                raise InputError(f"{place} has the direction 0 0 0; give the way of the instrument.")
            return vector / length
    return None


def _places(presses: Sequence[Press]) -> tuple[Press, ...]:
    """Name the places of presses that have coordinates only, by the first press there; without these, by each press."""
    first: dict[tuple, str] = {}
    found = []
    for press in presses:
        key: tuple = (press.name,) if press.at_m is None else (press.specimen, *press.at_m)
        found.append(replace(press, place=press.place or first.setdefault(key, press.name)))
    return tuple(found)


def _slope(press: Press) -> float:
    """Return the slope [N/m] of the line fitted to force over depth; 0 for a depth that is always the same."""
    away = press.depth_m - press.depth_m.mean()
    return float(away @ press.force_n / max(away @ away, 1e-300))


def _rises(press: Press) -> bool:
    """Whether the force rises by more than rounding."""
    return _slope(press) * float(np.ptp(press.depth_m)) > 1e-9 * float(np.abs(press.force_n).max())


def _check_units(records: PressRecords, size_m: float | None) -> None:
    """Raise InputError for depths, forces and an instrument that fit no organ."""
    path, presses, instrument = records.source, records.presses, records.instrument
    deepest = max(presses, key=lambda press: press.depth_m.max())
    depth = float(deepest.depth_m.max())
    if instrument is not None and size_m is not None and 2.0 * instrument.radius_m > size_m:
        raise InputError(
            f"{path}: the instrument is {2.0 * instrument.radius_m:g} m wide, and what it presses {size_m:g} m; give "
            "its radius in metres, and the body with its scale."
        )
    limits = [(DEEPEST_M, "deeper than any organ")]
    limits += [(size_m, f"and what it presses is {size_m:g} m thick")] if size_m is not None else []
    if instrument is not None:
        most = DEEPEST_RADII * instrument.radius_m
        limits.append((most, f"{depth / instrument.radius_m:.3g} radii of the instrument ({instrument.radius_m:g} m)"))
    for limit, words in limits:
        if depth > limit:
            raise InputError(
                f"{path}: the press {deepest.name} reaches a depth_m of {depth:g} m, {words}; give metres (millimetres "
                "times 0.001)."
            )
    peak = float(np.median([press.force_n.max() for press in presses]))
    if np.median([_slope(press) for press in presses]) < 0.0:
        raise InputError(f"{path}: force_n falls with depth in most presses; give forces positive where one presses.")
    for press in presses:
        if press.force_n.min() < -PULLS * abs(peak):
            raise InputError(
                f"{path}: the press {press.name} has a force_n of {press.force_n.min():g} N, where the middle press "
                f"reaches {peak:g} N; subtract the zero of the sensor, and leave out what pulls."
            )
    if instrument is not None:
        _check_modulus(records, instrument.radius_m)


def _hertz_modulus(records: PressRecords, radius_m: float) -> float:
    """Return the median modulus [Pa] of presses by a ball, by Hertz at the largest depth and ν = 0.5."""
    moduli = []
    for press in records.presses:
        last = int(press.depth_m.argmax())
        moduli.append(9.0 * press.force_n[last] / (16.0 * np.sqrt(radius_m) * press.depth_m[last] ** 1.5))
    return float(np.median(moduli))


def _check_modulus(records: PressRecords, radius_m: float) -> None:
    """Raise InputError for forces whose modulus no tissue has."""
    modulus = _hertz_modulus(records, radius_m)
    if not SOFTEST_PA < modulus < STIFFEST_PA:
        raise InputError(
            f"{records.source}: force_n over depth_m is that of a modulus of {modulus:.2g} Pa, of no soft tissue; give "
            "newtons (grams times 0.00981, millinewtons times 0.001), metres, and the instrument's radius in metres."
        )
