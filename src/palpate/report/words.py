"""Join words and format numbers for sentences and labels, without a figure: the page of a press needs them, too."""

import numpy as np


def spaced(name: str) -> str:
    """Return the name of a scene, a body or an effect without underscores."""
    return name.replace("_", " ")


def listed(parts: list[str]) -> str:
    """Join phrases as a sentence does: "a, b and c"."""
    return " and ".join([", ".join(parts[:-1]), parts[-1]] if len(parts) > 1 else parts)


def capital(sentence: str) -> str:
    """Begin a sentence with a capital letter."""
    return sentence[:1].upper() + sentence[1:]


def two_digits(value: float) -> str:
    """Write a number with two significant digits, and below a million without a power of ten: "130"."""
    return f"{float(f'{value:.2g}'):g}"


def percent(share: float) -> str:
    """Format a fraction as per cent with two significant digits and no exponent, "failed" if it is not finite."""
    if not np.isfinite(share):
        return "failed"
    value = 100 * share
    if 0 < value < 0.001:
        return "<\u00a00.001\u00a0%"
    return f"{value:.0f}\u00a0%" if value >= 10 else f"{two_digits(value)}\u00a0%"


def seconds(value: float) -> str:
    """Format a time [s] with three significant digits in s, ms or µs."""
    unit, factor = next(((u, f) for u, f in (("s", 1), ("ms", 1e3)) if value * f >= 1), ("µs", 1e6))
    return f"{float(f'{value * factor:.3g}'):g}\u00a0{unit}"
