"""Figures of paper 1's tables: features, width, premises, complexity, times, accuracy over cost."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from palpate.report import model_looks, style, tables
from palpate.report.words import seconds as written
from palpate.report.words import spaced
from palpate.report.work_precision import curves, finish, frames, points, steps
from palpate.report.work_precision import handles as handles_of


@style.figure("feature_vectors", tables=("feature_vectors", "premise_bodies"))
def draw_feature_vectors(feature_vectors, premise_bodies) -> Figure:
    """Draw a row for the most global and the most local premise, and a column for each kind of feature.

    Lines are the two presses; a title has the distance of their vectors over the length of the first.
    """
    premises = premise_bodies.sort_values("moved_share", ascending=False, kind="stable")
    shown = list(dict.fromkeys([premises["premise"].iloc[0], premises["premise"].iloc[-1]]))
    figure, grid = style.panels(len(shown), len(model_looks.FEATURES), (10, 2.1 * len(shown) + 0.8))
    for axes, premise in zip(grid, shown, strict=True):
        moved_share = premises.set_index("premise").loc[premise, "moved_share"]
        for axis, features in zip(axes, model_looks.FEATURES, strict=True):
            _vectors(axis, tables.where(feature_vectors, premise=premise, features=features), features)
        axes[0].set_ylabel(f"{premise.replace('_', ' ')}\n({100 * moved_share:.0f} % moves)\ndisplacement / peak")
    for axis in grid[-1]:
        axis.set_xlabel("place in the vector")
    figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure


def _vectors(axis, rows, features) -> None:
    colours = (model_looks.look(f"{features}_nonnegative_a").colour, style.INK)
    vectors = [press.sort_values(["node", "axis"])["share_of_peak"].to_numpy() for _, press in rows.groupby("press")]
    for i, (vector, colour) in enumerate(zip(vectors, colours, strict=True)):
        style_of = {"lw": 1.0 if len(vector) > 60 else 1.5, "ls": "-" if i == 0 else "--"}
        axis.plot(np.arange(len(vector)), vector, color=colour, label=("one node", "another node")[i], **style_of)
    distance = np.linalg.norm(vectors[1] - vectors[0]) / np.linalg.norm(vectors[0])
    axis.set_title(f"{model_looks.FEATURES[features][0]}\n{distance:.2f} apart")


@style.figure("sigma_sweep", tables=("sigma_sweep", "enrichment_accuracy"))
def draw_sigma_sweep(sigma_sweep, enrichment_accuracy, *, published: dict) -> Figure:
    """Draw a row for each body and regime, a column for each feature vector, a line for each kind of weights.

    published : the paper's numbers; ``sigma`` holds its σ and the length of a unit of its meshes here [m]
    Marks are the σ chosen by cross-validation on training samples (disc), the paper's σ (diamond), and the error of
    linear interpolation, which has no σ (dashed).
    """
    sweep = tables.where(sigma_sweep, protocol="paper", split="samples")
    accuracy = tables.where(enrichment_accuracy, protocol="paper", split="samples")
    rows = list(dict.fromkeys(zip(sweep["body"], sweep["regime"], strict=True)))
    features = [f for f in model_looks.FEATURES if f in set(sweep["features"])]
    size = (3.1 * len(features) + 0.4, 1.75 * len(rows) + 1.2)
    figure, grid = style.panels(len(rows), len(features), size, sharex=True, sharey="row")
    for axes, (body, regime) in zip(grid, rows, strict=True):
        unit_m = published["sigma"]["unit_m"].get(body)
        sigma_m = None if unit_m is None else published["sigma"]["value"] * unit_m
        errors_of_body = tables.where(accuracy, body=body, regime=regime).set_index("method")
        for axis, name in zip(axes, features, strict=True):
            panel = tables.where(sweep, body=body, regime=regime, features=name)
            for weights, curve in panel.groupby("weights", sort=False):
                _curve(axis, curve.sort_values("sigma_relative"), errors_of_body, f"{name}_{weights}", sigma_m)
            axis.axhline(100 * errors_of_body.loc["interpolation", "rmse_of_peak"], color=style.FAINT, ls="--", lw=1.2)
            axis.set(xscale="log", yscale="log")
        axes[0].set_ylabel(f"{body}, {regime} loads\nRMSE [% of peak]")
        style.plain_log(axes[0].yaxis)
    for axis, name in zip(grid[0], features, strict=True):
        axis.set_title(model_looks.FEATURES[name][0])
    for axis in grid[-1]:
        axis.set_xlabel("σ / median distance of training features")
        style.plain_log(axis.xaxis)
    figure.legend(handles=_sweep_legend(), loc="outside lower center", ncols=4)
    return figure


def _curve(axis, curve, accuracy, method, sigma_m) -> None:
    """Draw the errors of one method over σ, with a disc at its σ in ``accuracy`` and a diamond at ``sigma_m`` [m].

    A mark beyond the widths of the sweep is left out.
    """
    colour = model_looks.look(method).colour
    relative, error = curve["sigma_relative"].to_numpy(), 100 * curve["rmse_of_peak"].to_numpy()
    axis.plot(relative, error, color=colour, zorder=2)
    relative_per_metre = relative[0] / curve["sigma_m"].iloc[0]
    marks = [(accuracy["sigma_m"].get(method), "o", colour), (sigma_m, "D", "white")]
    for sigma, marker, fill in marks:
        place = np.nan if sigma is None else sigma * relative_per_metre
        if relative[0] <= place <= relative[-1] * (1 + 1e-9):
            height = np.exp(np.interp(np.log(place), np.log(relative), np.log(error)))
            axis.plot(place, height, marker, color=colour, mfc=fill, mec=colour, ms=5.5, zorder=3)


def _sweep_legend() -> list[Line2D]:
    """Return the handles; shades of grey represent the shades that each column has in its own hue."""
    greys = zip(("#2b2b2b", "#6f6f6f", "#a0a0a0", "#cfcfcf"), model_looks.WEIGHTS.values(), strict=True)
    lines = [Line2D([], [], color=grey, label=name) for grey, (name, _) in greys]
    return [
        *lines,
        Line2D([], [], ls="", marker="o", color=style.INK, label="σ by cross-validation"),
        Line2D([], [], ls="", marker="D", mfc="white", color=style.INK, label="the paper's σ"),
        Line2D([], [], ls="--", color=style.FAINT, label="linear interpolation"),
    ]


PAPERS = "nonnegative_a"
READINGS = {
    PAPERS: ("non-negative (a), the paper", "s"),
    "nonnegative_b": ("non-negative (b)", "D"),
    "literal": ("(a), equation 4 word for word", "v"),
    "linear": ("linear regressor of § 3.2", "P"),
}
"""Label and marker of each way to weigh samples that is compared."""
SHOWN = (0.08, 30.0)  # ratios that are shown; what is larger is marked at the end of the scale


@style.figure("premises", tables=("premises", "premise_bodies"))
def draw_premises(premises, premise_bodies) -> Figure:
    """Draw a row for each premise, the most local first: errors on the left, ratios to unordered features on the right.

    Contacts are held out. Whiskers hold 90 % of draws of splits and contacts. Left of the line ordered features pay;
    ratios beyond SHOWN are arrows at its end.
    """
    bodies = premise_bodies.sort_values("moved_share", kind="stable")
    errors = tables.where(premises, held_out="contacts")
    with_all_samples = errors[errors["train"] == errors.groupby("premise")["train"].transform("max")]
    figure, ((left, right),) = style.panels(1, 2, (10, 0.62 * len(bodies) + 1.7), sharey=True)
    right.set(xscale="log", xlim=SHOWN, xlabel="error / error of unordered features with the same weights")
    for y, row in enumerate(bodies.itertuples()):
        rows = tables.where(with_all_samples, premise=row.premise)
        _errors(left, y, rows)
        _ratios(right, y, rows)
    labels = [
        f"{row.premise.replace('_', ' ')}{'*' if row.responses == 'nonlinear' else ''}\n"
        f"{100 * row.moved_share:.0f} % of the surface moves"
        for row in bodies.itertuples()
    ]
    left.set_yticks(range(len(bodies)), labels)
    left.invert_yaxis()
    left.set(xscale="log", xlabel="RMSE [% of peak], mean of the test samples")
    right.axvline(1.0, color=style.INK, lw=1, zorder=1)
    for axis in (left, right):
        style.plain_log(axis.xaxis)
        axis.grid(axis="y", visible=False)
    figure.legend(handles=_premise_legend(), loc="outside lower center", ncols=3)
    return figure


def _errors(axis, y, rows) -> None:
    """Draw errors [% of peak] in row ``y``: marks of answers that need no samples, and whiskers of the features."""
    for name, marker, colour in (
        ("zero", "|", style.FAINT),
        ("interpolation", "X", model_looks.look("interpolation").colour),
    ):
        error = 100 * tables.where(rows, features=name)["rmse_of_peak"].iloc[0]
        axis.plot(error, y - 0.36, marker, color=colour, ms=11 if marker == "|" else 6, mew=2 if marker == "|" else 0.5)
    for i, features in enumerate(model_looks.FEATURES):
        row = tables.where(rows, features=features, weights=PAPERS).iloc[0]
        values = [100 * row[c] for c in ("rmse_of_peak", "error_low", "error_high")]
        _whisker(axis, y + 0.22 * (i - 1), values, features)


def _ratios(axis, y, rows) -> None:
    """Draw into row ``y`` the ratios of ordered features to unordered ones, one mark for each way to weigh."""
    for i, weights in enumerate(READINGS):
        for features, shift in (("ordered", -0.04), ("framed", 0.04)):
            row = tables.where(rows, features=features, weights=weights).iloc[0]
            values, marker = [row[c] for c in ("ratio", "ratio_low", "ratio_high")], READINGS[weights][1]
            if values[0] > 0.9 * SHOWN[1]:
                values, marker = [0.9 * SHOWN[1]] * 3, ">"
            _whisker(axis, y + 0.19 * (i - 1.5) + shift, values, features, marker)


def _whisker(axis, y, values, features, marker="s") -> None:
    """Draw one mark at the first of three ``values``, and a line between the others, the ends of its interval."""
    colour = model_looks.look(f"{features}_{PAPERS}").colour
    axis.plot(values[1:], [y, y], color=colour, lw=1.2, zorder=2)
    axis.plot(values[0], y, marker, color=colour, mec="white", mew=0.5, ms=5.5, zorder=3)


def _premise_legend() -> list[Line2D]:
    colours = [
        Line2D([], [], color=model_looks.look(f"{features}_{PAPERS}").colour, label=name)
        for features, (name, _) in model_looks.FEATURES.items()
    ]
    markers = [Line2D([], [], ls="", marker=m, color="#777777", label=name) for name, m in READINGS.values()]
    return [
        *colours,
        Line2D([], [], ls="", marker="|", ms=11, mew=2, color=style.FAINT, label="the zero answer"),
        Line2D([], [], ls="", marker="X", color=model_looks.look("interpolation").colour, label="linear interpolation"),
        *markers,
    ]


_COLOURS = {"r": "#0072b2", "k": "#d55e00"}


@style.figure("complexity", tables=("complexity",))
def draw_complexity(complexity) -> Figure:
    """Draw fitted exponents with confidence intervals (discs) and the paper's (diamonds)."""
    figure = Figure(figsize=(7.5, 0.62 * len(complexity) + 1.2), layout="constrained")
    axis = figure.subplots()
    for y, row in enumerate(complexity.to_dict("records")):
        for letter, shift in (("r", -0.14), ("k", 0.14)):
            value = row[f"exponent_{letter}"]
            interval = np.abs([[row[f"exponent_{letter}_{end}"] - value] for end in ("low", "high")])
            axis.errorbar(value, y + shift, xerr=interval, fmt="o", color=_COLOURS[letter], capsize=3)
            papers_exponent = row[f"paper_exponent_{letter}"]
            axis.plot(papers_exponent, y + shift, "D", mfc="none", mec=style.INK, ms=9, mew=0.9, zorder=3)
    labels = [
        f"{model_looks.OPERATIONS.get(row.operation, row.operation)}\n{row.paper_order.replace('^2', '²')}"
        for row in complexity.itertuples()
    ]
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


@style.figure("timing_bars", tables=("enrichment_timing",))
def draw_timing_bars(enrichment_timing) -> Figure:
    """Draw two bars for each method on a logarithmic scale; dots are the five deformations."""
    timing = enrichment_timing
    names = tables.bodies(timing)
    figure = Figure(figsize=(10, 0.5 * len(set(timing["method"])) + 1.3), layout="constrained")
    for axis, body in zip(figure.subplots(1, len(names), sharex=True, squeeze=False)[0], names, strict=True):
        rows = tables.where(timing, body=body)
        shortest_s = 0.3 * timing[["mean_s", "paper_mean_s"]].min().min()
        for y, row in enumerate(rows.itertuples()):
            _bar(axis, y + 0.2, row.mean_s, shortest_s, color=model_looks.look(row.method).colour)
            _bar(axis, y - 0.2, row.paper_mean_s, shortest_s, color="white", edgecolor="#555555", hatch="////")
            times = [getattr(row, f"d{i}_s") for i in range(1, 6)]
            axis.plot(times, [y + 0.2] * 5, "o", color="white", mec=style.INK, ms=3, mew=0.6)
        axis.set_yticks(range(len(rows)), [model_looks.short(m).replace("\n", " ") for m in rows["method"]])
        axis.set(xscale="log", title=body, xlabel="time a deformation [s]")
        axis.set_xlim(shortest_s, 40 * timing[["mean_s", "paper_mean_s"]].max().max())
        axis.invert_yaxis()
        axis.grid(axis="y", visible=False)
    handles = [
        Patch(facecolor="white", edgecolor="#555555", hatch="////", label="the paper (its machine, 2020)"),
        Patch(facecolor="#777777", label="palpate (this machine, one core)"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=2)
    return figure


def _bar(axis, y, seconds, left_s, **look) -> None:
    """Draw one bar with its number at the end; none where the paper has no such row."""
    if seconds > 0:
        axis.barh(y, seconds - left_s, left=left_s, height=0.36, linewidth=0.7, **look)
        axis.annotate(written(seconds), (seconds, y), (5, 0), textcoords="offset points", va="center", fontsize=7.5)


@style.figure("accuracy_vs_online_cost", tables=("enrichment_accuracy", "online_cost", "fem_cost"))
def draw_accuracy_vs_online_cost(enrichment_accuracy, online_cost, fem_cost) -> Figure:
    """Draw one column for each body and one row for each protocol and regime, with contacts held out.

    The whisker ends at the 95th percentile of the time. The stepped line is the Pareto front. A method without a
    finite error or time is named in its panel as failed.
    """
    accuracy = tables.where(enrichment_accuracy, split="contacts")
    joined = accuracy.merge(online_cost, on=["body", "protocol", "method"], how="left")
    names = tables.bodies(joined)
    rows = list(dict.fromkeys(zip(joined["protocol"], joined["regime"], strict=True)))
    size = (4.0 * len(names) + 2.4, 2.6 * len(rows) + 0.6)
    figure, grid = style.panels(len(rows), len(names), size, sharex=True, sharey=True)
    joined = joined.assign(model=joined["method"], late=1e3 * joined["online_p95_s"])
    points_of = {}
    for axes, (protocol, regime) in zip(grid, rows, strict=True):
        for axis, body in zip(axes, names, strict=True):
            panel = tables.where(joined, body=body, protocol=protocol, regime=regime)
            points_of[axis] = _points(axis, panel)
            fine_fem_ms = 1e3 * tables.where(fem_cost, body=body, regime=regime)["seconds"].median()
            axis.axvline(fine_fem_ms, color=model_looks.look("fine_fem").colour, ls="-.", lw=1, zorder=1)
            axis.set_title(f"{body}, {protocol} protocol, {spaced(regime)} loads", pad=18)
        axes[0].set_ylabel("RMSE [% of peak]")
    for axis in grid[-1]:
        axis.set_xlabel("online time a query [ms]")
    bottom, top = grid[0, 0].get_ylim()
    grid[0, 0].set_ylim(bottom / 2, top)  # room for the names of failures
    for axis, shown_points in points_of.items():
        steps(axis, shown_points)
    finish(grid.ravel(), frames())
    handles = handles_of(
        points(
            joined.sort_values("method", key=lambda names: names.map(list(model_looks.METHODS).index)),
            "online_median_s",
            "rmse_of_peak",
        ),
        lines=False,
    )
    handles.append(Line2D([], [], color=style.INK, lw=1, label="Pareto front"))
    handles.append(Line2D([], [], color=model_looks.look("fine_fem").colour, ls="-.", lw=1, label="fine FEM"))
    figure.legend(handles=handles, loc="outside right center", title="less of both is better")
    return figure


def _points(axis, panel) -> pd.DataFrame:
    """Draw the points of all methods with the 95th percentiles of their times, and name those that failed."""
    drawn = points(panel, "online_median_s", "rmse_of_peak")
    curves(axis, drawn)
    colours = [model_looks.look(method).colour for method in drawn["model"]]
    axis.hlines(drawn["error"], drawn["time"], panel.loc[drawn.index, "late"], colors=colours, lw=1, zorder=3)
    failed = panel["method"][~panel.index.isin(drawn.index)]
    if len(failed):
        text = "failed: " + ", ".join(model_looks.look(m).label for m in failed)
        axis.text(0.01, 0.03, text, transform=axis.transAxes, fontsize=7, color="#aa0000")
    return drawn


_REGIMES = (("#0072b2", "o"), ("#d55e00", "^"), ("#009e73", "s"), ("#7d7d7d", "D"))


@style.figure("fem_cost", tables=("fem_cost", "sample_peaks"))
def draw_fem_cost(fem_cost, sample_peaks) -> Figure:
    """Draw seconds and Newton iterations over the peak displacement [mm], one column for each body."""
    joined = fem_cost.merge(sample_peaks, on=["body", "regime", "sample"], validate="one_to_one")
    names = tables.bodies(joined)
    figure, grid = style.panels(2, len(names), (4.2 * len(names) + 0.4, 5), sharex=True, sharey="row")
    for column, body in zip(grid.T, names, strict=True):
        rows_of_body = tables.where(joined, body=body)
        for (regime, rows), (colour, marker) in zip(rows_of_body.groupby("regime", sort=False), _REGIMES, strict=False):
            label = f"{regime} loads: median {rows['seconds'].median():.2g} s, most {rows['seconds'].max():.2g} s"
            looks = {"color": colour, "ms": 4, "mec": "white", "mew": 0.4, "label": label}
            for axis, value in zip(column, ("seconds", "newton_iterations"), strict=True):
                axis.plot(1e3 * rows["peak_m"], rows[value], marker, **looks)
        column[0].set(xscale="log", yscale="log")
        column[0].set_title(body, pad=32)
        column[0].legend(loc="lower left", bbox_to_anchor=(-0.03, 0.99))
        column[1].set(xlabel="peak displacement [mm]", ylim=(0, None))
    style.plain_log(grid[0, 0].xaxis, grid[0, 0].yaxis)
    grid[0, 0].set_ylabel("time of a fine simulation [s]")
    grid[1, 0].set_ylabel("Newton iterations")
    return figure
