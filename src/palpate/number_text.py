"""Write numbers with two significant digits, for sentences, labels and tables."""

import numpy as np


def two_digits(value: float) -> str:
    """Write a number with two significant digits, and below a million without a power of ten: "130"."""
    return f"{float(f'{value:.2g}'):g}"


def percent_in_table(share: float) -> str:
    """Write a share in per cent with two significant digits and an ordinary blank, "failed" if it is not finite."""
    return f"{two_digits(100 * share)} %" if np.isfinite(share) else "failed"


def percent(share: float) -> str:
    """Write the same for a sentence or a label: on one line, and below 0.001 % as that."""
    if not np.isfinite(share):
        return "failed"
    value = 100 * share
    if 0 < value < 0.001:
        return "<\u00a00.001\u00a0%"
    return f"{value:.0f}\u00a0%" if value >= 10 else f"{two_digits(value)}\u00a0%"
