"""Join words and format numbers for sentences and labels, without a figure: the page of a press needs them, too."""

from collections.abc import Callable, Iterable

import numpy as np

from palpate.number_text import percent, two_digits


def spaced(name: str) -> str:
    """Return the name of a scene, a body or an effect without underscores."""
    return name.replace("_", " ")


def listed(parts: Iterable[str]) -> str:
    """Join phrases as a sentence does: "a, b and c"."""
    *others, final = [*parts] or [""]
    return f"{', '.join(others)} and {final}" if others else final


def capital(sentence: str) -> str:
    """Begin a sentence with a capital letter."""
    return sentence[:1].upper() + sentence[1:]


def span(values: Iterable[float], write: Callable[[float], str] = percent) -> str:
    """Write the least and the most of some shares, "1 % to 3 %", once if they read alike; other values by ``write``."""
    finite = [value for value in values if np.isfinite(value)]
    if not finite:
        return "unknown"
    return " to ".join(dict.fromkeys(map(write, (min(finite), max(finite)))))


def seconds(value: float) -> str:
    """Format a time [s] with three significant digits in s, ms or µs."""
    unit, factor = next(((u, f) for u, f in (("s", 1), ("ms", 1e3)) if value * f >= 1), ("µs", 1e6))
    return f"{float(f'{value * factor:.3g}'):g}\u00a0{unit}"


def metres(value: float) -> str:
    """Format a length [m] with two significant digits in m or mm."""
    return f"{two_digits(value)}\u00a0m" if value >= 1.0 else f"{two_digits(1e3 * value)}\u00a0mm"


def pascals(value: float, digits: int = 2) -> str:
    """Write a modulus with two digits: "2.1 kPa"."""
    units = (("MPa", 1e6), ("kPa", 1e3), ("Pa", 0.0))
    unit, factor = next(pair for pair in units if value >= 0.995 * pair[1])
    return f"{float(f'{value / (factor or 1.0):.{digits}g}'):g} {unit}"
