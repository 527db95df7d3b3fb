"""Growth of each operation's time with the features r and the samples k (paper 1's table 3)."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from palpate.report import style

TABLES = ("complexity",)
_COLOURS = {"r": "#0072b2", "k": "#d55e00"}


@style.styled
def draw(complexity) -> Figure:
    """Draw fitted exponents with confidence intervals (discs) and the paper's (diamonds).

    complexity : the table of this name
    """
    figure = Figure(figsize=(7.5, 0.62 * len(complexity) + 1.2), layout="constrained")
    axis = figure.subplots()
    for y, row in enumerate(complexity.to_dict("records")):
        for letter, shift in (("r", -0.14), ("k", 0.14)):
            value = row[f"exponent_{letter}"]
            reach = np.abs([[row[f"exponent_{letter}_{end}"] - value] for end in ("low", "high")])
            axis.errorbar(value, y + shift, xerr=reach, fmt="o", color=_COLOURS[letter], capsize=3)
            axis.plot(
                row[f"paper_exponent_{letter}"],
                y + shift,
                "D",
                mfc="none",
                mec=style.INK,
                ms=9,
                mew=0.9,
                zorder=3,
            )
    names = zip(complexity["operation"], complexity["paper_order"], strict=True)
    labels = [f"{style.OPERATIONS.get(o, o)}\n{order.replace('^2', '²')}" for o, order in names]
    axis.set_yticks(range(len(complexity)), labels)
    axis.set(xlabel="exponent of the measured time", ylim=(len(complexity) - 0.5, -0.5), xlim=(0, None))
    axis.grid(axis="y", visible=False)
    handles = [
        Line2D([], [], marker="o", color=_COLOURS["r"], label="in r (features), measured"),
        Line2D([], [], marker="o", color=_COLOURS["k"], label="in k (samples), measured"),
        Line2D([], [], ls="", marker="D", mfc="none", mec=style.INK, ms=8, label="the paper's order"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=3)
    return figure
