"""How far palpate's values are from published ones."""

import numpy as np
from matplotlib.figure import Figure

from palpate.report import style

LEAST_SHARE = 1e-12
"""Smallest share that the axis shows."""


@style.figure("outside", tables=("outside",))
def draw_outside(outside) -> Figure:
    """Draw the difference of each quantity from its published value as a dot, and palpate's own error as a line."""
    figure, ((axis,),) = style.panels(1, 1, (9, 0.5 + 0.3 * len(outside)))
    rows = np.arange(len(outside))
    axis.hlines(
        rows, LEAST_SHARE, outside["own_error"].clip(lower=LEAST_SHARE), color=style.FAINT, lw=5, label="own error"
    )
    axis.plot(outside["difference"].abs().clip(lower=LEAST_SHARE), rows, "o", color="#d55e00", label="difference")
    axis.set(xscale="log", xlim=(LEAST_SHARE, 0.2), xlabel="share of the published value")
    axis.set_yticks(rows, outside["quantity"])
    axis.invert_yaxis()
    axis.legend(loc="upper right")
    return figure
