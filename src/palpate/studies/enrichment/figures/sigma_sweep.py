"""Error over the kernel's width σ, for every feature vector and kind of weights (paper 1's figure 4)."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from palpate.report import style, tables

TABLES = ("sigma_sweep", "enrichment_accuracy")


@style.styled
def draw(
    sigma_sweep, enrichment_accuracy, *, published: dict, protocol: str = "paper", split: str = "samples"
) -> Figure:
    """Draw a row for each body and regime, a column for each feature vector, a line for each kind of weights.

    sigma_sweep, enrichment_accuracy : the tables of these names
    published : the paper's numbers; ``sigma`` holds its σ and the length of a unit of its meshes here [m]
    Marks are the σ chosen by cross-validation on training samples (disc), the paper's σ (diamond), and the error of
    linear interpolation, which has no σ (dashed).
    """
    sweep = tables.where(sigma_sweep, protocol=protocol, split=split)
    accuracy = tables.where(enrichment_accuracy, protocol=protocol, split=split)
    rows = list(dict.fromkeys(zip(sweep["body"], sweep["regime"], strict=True)))
    features = [f for f in style.FEATURES if f in set(sweep["features"])]
    figure = Figure(figsize=(3.1 * len(features) + 0.4, 1.75 * len(rows) + 1.2), layout="constrained")
    grid = figure.subplots(len(rows), len(features), sharex=True, sharey="row", squeeze=False)
    for axes, (body, regime) in zip(grid, rows, strict=True):
        unit_m = published["sigma"]["unit_m"].get(body)
        sigma_m = None if unit_m is None else published["sigma"]["value"] * unit_m
        here = tables.where(accuracy, body=body, regime=regime).set_index("method")
        for axis, name in zip(axes, features, strict=True):
            panel = tables.where(sweep, body=body, regime=regime, features=name)
            for weights, curve in panel.groupby("weights", sort=False):
                _curve(axis, curve.sort_values("sigma_relative"), here, f"{name}_{weights}", sigma_m)
            axis.axhline(100 * here.loc["interpolation", "rmse_of_peak"], color=style.FAINT, ls="--", lw=1.2)
            axis.set(xscale="log", yscale="log")
        axes[0].set_ylabel(f"{body}, {regime} loads\nRMSE [% of peak]")
        style.plain_log(axes[0].yaxis)
    for axis, name in zip(grid[0], features, strict=True):
        axis.set_title(style.FEATURES[name][0])
    for axis in grid[-1]:
        axis.set_xlabel("σ / median distance of training features")
        style.plain_log(axis.xaxis)
    figure.legend(handles=_legend(), loc="outside lower center", ncols=4)
    return figure


def _curve(axis, curve, accuracy, method, sigma_m) -> None:
    """Draw one line with its two marks; a mark beyond the sweep's ends is left out."""
    colour = style.look(method).colour
    relative, error = curve["sigma_relative"].to_numpy(), 100 * curve["rmse_of_peak"].to_numpy()
    axis.plot(relative, error, color=colour, zorder=2)
    ratio = relative[0] / curve["sigma_m"].iloc[0]
    marks = [(accuracy["sigma_m"].get(method), "o", colour), (sigma_m, "D", "white")]
    for sigma, marker, fill in marks:
        at = np.nan if sigma is None else sigma * ratio
        if relative[0] <= at <= relative[-1] * (1 + 1e-9):
            height = np.exp(np.interp(np.log(at), np.log(relative), np.log(error)))
            axis.plot(at, height, marker, color=colour, mfc=fill, mec=colour, ms=5.5, zorder=3)


def _legend() -> list[Line2D]:
    """Return the handles; shades of grey represent the shades that each column has in its own hue."""
    greys = ("#2b2b2b", "#6f6f6f", "#a0a0a0", "#cfcfcf")
    lines = [
        Line2D([], [], color=grey, label=name) for grey, (name, _) in zip(greys, style.WEIGHTS.values(), strict=True)
    ]
    return [
        *lines,
        Line2D([], [], ls="", marker="o", color=style.INK, label="σ by cross-validation"),
        Line2D([], [], ls="", marker="D", mfc="white", color=style.INK, label="the paper's σ"),
        Line2D([], [], ls="--", color=style.FAINT, label="linear interpolation"),
    ]
