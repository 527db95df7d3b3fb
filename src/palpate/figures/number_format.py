"""Numbers as they stand in sentences."""

from collections.abc import Callable, Iterable

import numpy as np


def percent(share: float) -> str:
    """A share as per cent with two significant digits and no exponent, "failed" if it is not finite."""
    if not np.isfinite(share):
        return "failed"
    value = 100 * share
    if 0 < value < 0.001:
        return "<\u00a00.001\u00a0%"
    return f"{value:.0f}\u00a0%" if value >= 10 else f"{float(f'{value:.2g}'):g}\u00a0%"


def seconds(value: float) -> str:
    """A time with three significant digits in the unit that suits it."""
    unit, factor = next(((u, f) for u, f in (("s", 1), ("ms", 1e3)) if value * f >= 1), ("µs", 1e6))
    return f"{float(f'{value * factor:.3g}'):g}\u00a0{unit}"


def each(names: Iterable[str], phrase: Callable[[str], str]) -> str:
    """One phrase a body or scene."""
    return "; ".join(f"{name}: {phrase(name)}" for name in names)
