"""What a user knows of measured presses, the forward models of laws for it, and the rows of what presses determine."""

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd

from palpate.bodies.body import Body
from palpate.bodies.material import EXPONENTIAL
from palpate.effects.instrument import Instrument
from palpate.errors import NotConverged
from palpate.identification.fit import OFFSETS, Options
from palpate.identification.forward import Forward, Range, SlabForward
from palpate.identification.identify import Identified, identify
from palpate.identification.prediction import predict
from palpate.identification.presses import PressRecords
from palpate.identification.progress import UNFOLLOWED, Progress

LAWS = ("neo_hookean", "exponential")
"""The laws that are compared unless others are asked for; the second stiffens by a parameter, without which it is the
first."""
STIFFENING, NARROWER, MOST_ERROR = (0.0, 20.0), 3, 0.03
"""Range of the exponential law's stiffening; how often its end is halved where the law does not bear the presses, or
forces between its curves have an error above the last, as a share."""
POISSON, STICKING = (0.3, 0.49), (0.0, 1.0)
"""Ranges of ν and of friction that are never fixed silently."""


@dataclass(frozen=True)
class Asked:
    """What the user has given besides presses, among it ranges (low, high).

    body : the organ, or None; thickness_m : of a slab, or None; without both the tissue is a half-space
    laws : that are compared; offset_m : range of the mean offset of first touch [m]
    columns : the file's names of columns, as ``read_presses`` takes them
    """

    instrument: Instrument
    body: Body | None = None
    thickness_m: Range | None = None
    poisson: Range = POISSON
    sticking: Range = STICKING
    laws: Sequence[str] = LAWS
    offset_m: tuple[float, float] | None = None
    columns: Mapping[str, str] = field(default_factory=dict)


def thickness_of(records: PressRecords, request: Asked) -> tuple[Range | None, np.ndarray | None]:
    """Return the slab's thickness [m] as given, or else the range of the presses' and that of each, (presses,)."""
    each = [press.thickness_m for press in records.presses if press.thickness_m is not None]
    if request.body is not None:
        return None, None
    if request.thickness_m is not None or len(each) < len(records.presses):
        return request.thickness_m, None
    return (float(min(each)), float(max(each))), np.array(each)


def forwards_for(
    records: PressRecords, asked: Asked, folder: Path | None = None, progress: Progress = UNFOLLOWED
) -> dict[str, Forward]:
    """Return the forward model of each law that is asked for.

    folder : where computed curves are stored, or None
    Warns of a law without an equilibrium at the deepest press, which is left out, and of a stiffening whose range is
    narrowed; NotConverged where no law is left.
    """
    largest_m = max(float(press.depth_m.max()) for press in records.presses)
    deepest_m = largest_m - min((asked.offset_m or (OFFSETS[0] * largest_m, 0.0))[0], 0.0)
    forwards: dict[str, SlabForward] = {}
    thickness, thickness_each = thickness_of(records, asked)
    forward_of = partial(
        SlabForward, asked.instrument.radius_m, deepest_m, thickness_m=thickness, poisson=asked.poisson,
        sticking=asked.sticking, folder=folder, progress=progress, each_m=thickness_each,
    )  # fmt: skip
    # the exponential law first: without stiffening its curves are the neo-Hookean ones
    for law in sorted(asked.laws, key=lambda law: law != EXPONENTIAL):
        if law == LAWS[0] and EXPONENTIAL in forwards:
            forwards[law] = forwards[EXPONENTIAL].without_stiffening()
            continue
        try:
            forwards[law] = _with_least_narrowing(forward_of, law)
        except NotConverged as failure:
            if len(asked.laws) == 1:
                raise
            warnings.warn(f"{records.source}: {failure}; the law is left out.", stacklevel=2)
    if not forwards:
        raise NotConverged("no law that is asked for bears the deepest press", [float("nan")])
    in_order = {law: forwards[law] for law in asked.laws if law in forwards}
    if asked.body is None:
        return dict(in_order)
    from palpate.identification.on_body import OrganForward

    shared = asked.body, asked.instrument, records.presses
    return {law: OrganForward(*shared, slab, law, slab.known) for law, slab in in_order.items()}


def _with_least_narrowing(forward_of: Callable[..., SlabForward], law: str) -> SlabForward:
    """Return the forward model of a law; the range of stiffening is halved until it can be computed and interpolated.

    Warns where it was halved; NotConverged where NARROWER times are too few.
    """
    low, high = full_range = STIFFENING if law == EXPONENTIAL else (0.0, 0.0)
    reason = "steeper laws do not bear the presses"
    for halvings in range(NARROWER, -1, -1):
        is_last = high == low or not halvings
        try:
            forward = forward_of(law=law, stiffening=(low, high))
            if forward.relative_error <= MOST_ERROR or is_last:
                break
            reason = f"with more, forces between curves have an error of {forward.relative_error:.0%}"
        except NotConverged:
            if is_last:
                raise
        high = max(low, 0.5 * high)
    if high < full_range[1]:
        warnings.warn(f"stiffening is looked for up to {high:g}; {reason}.", stacklevel=3)
    return forward


def identify_and_predict(
    records: PressRecords, asked: Asked, options: Options, by: Sequence[str], folder: Path,
    progress: Progress = UNFOLLOWED,
) -> tuple[Identified, pd.DataFrame]:  # fmt: skip
    """Fit the laws that are asked for to presses, and predict presses left out; the arguments are those of both."""
    identified = identify(records, forwards_for(records, asked, folder, progress), options, progress)
    return identified, predict(identified.models, identified.best, options, by, progress)


def table_rows(identified: Identified, part: str) -> list[tuple]:
    """Return rows for one ``part`` of the presses, with the columns of the study's table ``presses`` but the first."""
    units, rows = {"offset_scatter_m": "m", "noise_n": "N", "young_pa": "Pa", "modulus_pa": "Pa"}, []
    for name, interval in identified.intervals.items():
        unit = units.get(name, "m" * name.endswith("_m"))
        resampled = identified.resampled.get(name)
        ends = (resampled.low, resampled.high) if resampled else (None, None)
        rows.append((part, identified.law, True, name, unit, *interval[:3], interval.known, *interval[3:5], *ends))
    for name, value in identified.scatter.items():
        rows.append((part, identified.law, True, name, units.get(name, "1"), None, value, *6 * [None]))
    for score in identified.laws:
        reported = score.law == identified.law
        excess = *score.excess[:3], True, False, False, None, None
        rows.append((part, score.law, reported, "exponent_excess", "1", *excess))
        rows.append((part, score.law, reported, "likelihood_above", "1", None, score.above, *6 * [None]))
    return rows
