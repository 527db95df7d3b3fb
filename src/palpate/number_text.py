"""Write numbers with two significant digits, for sentences, labels and tables."""

import numpy as np


def two_digits(value: float) -> str:
    """Write a number with two significant digits, and below a million without a power of ten: "130"."""
    return f"{float(f'{value:.2g}'):g}"


def percent(share: float, table: bool = False) -> str:
    """Write a share in per cent with two significant digits, "failed" if it is not finite.

    table : of a CSV, which has ordinary blanks and no least value; elsewhere it is written without an exponent
    """
    if not np.isfinite(share):
        return "failed"
    value = 100 * share
    if table:
        return f"{two_digits(value)} %"
    if 0 < value < 0.001:
        return "<\u00a00.001\u00a0%"
    return f"{value:.0f}\u00a0%" if value >= 10 else f"{two_digits(value)}\u00a0%"
