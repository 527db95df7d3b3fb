"""Growth per step of each integrator, and the step at which it becomes unstable."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from palpate.report import style

TABLES = ("integrator_stability",)
_NAMES = {"symplectic_euler": "symplectic Euler", "goal_position": "goal positions", "backward_euler": "backward Euler"}
_LOOKS = {
    "symplectic_euler": (("#d55e00", "o"),),
    "goal_position": (("#8cc4e6", "s"), ("#3f9bd1", "D"), ("#0072b2", "^")),
    "backward_euler": (("#009e73", "v"),),
}
"""Colour and marker of each scheme, a shade for each α."""


@style.styled
def draw(integrator_stability) -> Figure:
    """Draw the growth per step over the step, by formulas (lines) and simulations (markers), and their difference.

    integrator_stability : the table of this name
    """
    stability = integrator_stability
    figure = Figure(figsize=(7.5, 5.2), layout="constrained")
    growth, error = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
    handles = []
    for scheme, looks in _LOOKS.items():
        cases = stability[stability["scheme"] == scheme].groupby("alpha", dropna=False)
        for (alpha, rows), (colour, marker) in zip(cases, looks, strict=False):
            x, expected, found = (rows[c] for c in ("h_over_sqrt_m_k", "spectral_radius", "growth_measured"))
            growth.plot(x, expected, color=colour)
            growth.plot(x, found, marker, color=colour, mec="white", mew=0.5, ms=5)
            # an exact growth has no place on a logarithmic axis
            error.plot(x, np.maximum(np.abs(found / expected - 1.0), 1e-16), marker, color=colour, ms=3.5)
            label = _NAMES[scheme] + (f", α = {alpha:g}" if np.isfinite(alpha) else "")
            handles.append(Line2D([], [], color=colour, marker=marker, ms=5, mec="white", mew=0.5, label=label))
    _threshold(growth, stability)
    growth.set(xscale="log", yscale="log", ylabel="growth per step", title="one mass on a spring")
    error.set(yscale="log", xlabel="h / sqrt(m/k)", ylabel="relative\ndifference", xlim=(0.009, 110))
    style.plain_log(error.xaxis)
    figure.legend(handles=handles, loc="outside right upper", title="line: spectral radius\nmarker: simulation")
    return figure


def _threshold(axis, stability) -> None:
    """Mark the step at which simulations become unstable, for schemes with such a step."""
    finite = stability[np.isfinite(stability["blow_up_measured"])]
    for scheme, rows in finite.groupby("scheme"):
        at, stated = rows[["blow_up_measured", "limit_stated"]].iloc[0]
        axis.axvline(at, color=style.FAINT, ls=":", lw=1)
        text = f"{_NAMES[scheme]} unstable\nfrom {at:.4f} (stated limit {stated:.4f})"
        axis.annotate(
            text, (at, 0.97), (-6, 0), xycoords=("data", "axes fraction"),
            textcoords="offset points", ha="right", va="top", fontsize=8,
        )  # fmt: skip
