"""What is asked of presses: instrument, tissue and what is known of it; the forward models of it, and the table."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from palpate.bodies.body import Body
from palpate.effects.instrument import Instrument
from palpate.identification.fit import OFFSETS
from palpate.identification.forward import Forward, Range, SlabForward
from palpate.identification.identify import Identified
from palpate.identification.intervals import Interval
from palpate.identification.presses import PressRecords
from palpate.table_declaration import Table

LAWS = ("neo_hookean", "exponential")
"""The laws that are compared unless others are asked for; the second stiffens by a parameter."""
EXPONENTIAL, STIFFENING = "exponential", (0.0, 20.0)
"""The law whose stiffening is fitted, and its range."""
POISSON, STICKING = (0.3, 0.49), (0.0, 1.0)
"""Ranges of ν and of friction that are never fixed silently."""
MARGIN = 1.5
"""Of the least offset of first touch: so much deeper a model is asked."""
IDENTIFIED = Table(
    "identified",
    "What presses determine, with intervals of 90 % unless asked otherwise.",
    """
    part: the specimen and session that were fitted, or all
    law reported: the law, and whether it is the one that fits best
    quantity unit: a parameter, E, a scatter or the exponent of depth that the law lacks
    low best high: the interval, by profile likelihood
    known: whether the presses say more than the range did
    open_low open_high: whether an end is that of the range
    resampled_low resampled_high: the interval by drawing places with replacement
    """,
)


@dataclass(frozen=True)
class Asked:
    """What the user has given besides presses; a range is (low, high).

    body : the organ, or None; thickness_m : of a slab, or None; without both the tissue is a half-space
    poisson, sticking, stiffening : known or ranges; laws : that are compared; offset_m : of first touch
    """

    instrument: Instrument
    body: Body | None = None
    thickness_m: Range | None = None
    poisson: Range = POISSON
    sticking: Range = STICKING
    stiffening: Range = STIFFENING
    laws: Sequence[str] = LAWS
    offset_m: tuple[float, float] | None = None
    columns: Mapping[str, str] = field(default_factory=dict)


def forwards_for(records: PressRecords, asked: Asked, folder: Path | None = None) -> dict[str, Forward]:
    """Return the forward model of each law that is asked for; folder : keeps their curves."""
    largest = max(float(press.depth_m.max()) for press in records.presses)
    least = (asked.offset_m or (OFFSETS[0] * largest, 0.0))[0]
    deepest = largest - MARGIN * min(least, 0.0)
    forwards: dict[str, Forward] = {}
    for law in asked.laws:
        stiffening = asked.stiffening if law == EXPONENTIAL else 0.0
        local = SlabForward(
            asked.instrument.radius_m, deepest, law, None if asked.body is not None else asked.thickness_m,
            asked.poisson, stiffening, asked.sticking, folder,
        )  # fmt: skip
        forwards[law] = local if asked.body is None else _on_body(asked, records, local, law)
    return forwards


def _on_body(asked: Asked, records: PressRecords, local: Forward, law: str) -> Forward:
    from palpate.identification.on_body import OrganForward

    assert asked.body is not None
    given = {"poisson": asked.poisson, "sticking": asked.sticking}
    given |= {"stiffening": asked.stiffening} if law == EXPONENTIAL else {}
    ends = {name: value if isinstance(value, tuple) else (value, value) for name, value in given.items()}
    known = {name: low for name, (low, high) in ends.items() if low == high}
    return OrganForward(asked.body, asked.instrument, records.presses, local, law, known, os.cpu_count() or 1)


def table_rows(found: Identified, part: str) -> list[tuple]:
    """Return the rows of IDENTIFIED of one part of the presses."""
    named: list[tuple[str, str, Interval]] = [("young_pa", "Pa", found.young_pa)]
    if found.modulus_pa is not None:
        named.append(("modulus_pa", "Pa", found.modulus_pa))
    named += [(name, found.units[name], interval) for name, interval in found.parameters.items()]
    if found.offset_m is not None:
        named.append(("offset_m", "m", found.offset_m))
    scatter = {
        "offset_scatter_m": ("m", found.offset_scatter_m), "place_scatter": ("1", found.place_scatter),
        "shape_scatter": ("1", found.shape_scatter), "repeat_scatter": ("1", found.repeat_scatter),
        "noise_share": ("1", found.noise_share), "noise_n": ("N", found.noise_n),
        "relative_error": ("1", found.relative_error), "table_error": ("1", found.table_error),
    }  # fmt: skip
    rows = []
    for name, unit, interval in named:
        drawn = found.resampled.get(name)
        ends = (drawn.low, drawn.high) if drawn else (None, None)
        rows.append((part, found.law, True, name, unit, *interval[:3], interval.known, *interval[3:5], *ends))
    rows += [(part, found.law, True, name, unit, None, value, *6 * [None]) for name, (unit, value) in scatter.items()]
    for score in found.laws:
        own = score.law == found.law
        rows.append((part, score.law, own, "exponent_excess", "1", *score.excess[:3], True, False, False, None, None))
        rows.append((part, score.law, own, "likelihood_above", "1", None, score.above, *6 * [None]))
    return rows
