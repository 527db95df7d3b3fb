"""Figures of paper 3, chapter 3: integrators, modes, clusters, cost, body springs and dampers."""

import matplotlib
import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from palpate.report import style, tables
from palpate.report.words import percent, spaced
from palpate.studies.shape_matching.claims import displacement, held
from palpate.studies.shape_matching.shape_matching_timing import HEADLINE, exponents, headline

_NAMES = {"symplectic_euler": "symplectic Euler", "goal_position": "goal positions", "backward_euler": "backward Euler"}
_LOOKS = {
    "symplectic_euler": (("#d55e00", "o"),),
    "goal_position": (("#8cc4e6", "s"), ("#3f9bd1", "D"), ("#0072b2", "^")),
    "backward_euler": (("#009e73", "v"),),
}
"""Colour and marker of each scheme, a shade for each α."""


@style.figure("integrator_stability", tables=("integrator_stability",))
def draw_integrator_stability(integrator_stability) -> Figure:
    """Draw the growth per step over the step, by formulas (lines) and simulations (markers), and their difference."""
    figure, ((growth,), (error,)) = style.panels(2, 1, (7.5, 5.2), sharex=True, height_ratios=(3, 1))
    handles = []
    for scheme, looks in _LOOKS.items():
        cases = tables.where(integrator_stability, scheme=scheme).groupby("alpha", dropna=False)
        for (alpha, rows), (colour, marker) in zip(cases, looks, strict=False):
            x, expected, measured = (rows[c] for c in ("h_over_sqrt_m_k", "spectral_radius", "growth_measured"))
            growth.plot(x, expected, color=colour)
            growth.plot(x, measured, marker, color=colour, mec="white", mew=0.5, ms=5)
            # an exact growth has no place on a logarithmic axis
            error.plot(x, np.maximum(np.abs(measured / expected - 1.0), 1e-16), marker, color=colour, ms=3.5)
            label = _NAMES[scheme] + (f", α = {alpha:g}" if np.isfinite(alpha) else "")
            handles.append(Line2D([], [], color=colour, marker=marker, ms=5, mec="white", mew=0.5, label=label))
    _threshold(growth, integrator_stability)
    growth.set(xscale="log", yscale="log", ylabel="growth per step", title="one mass on a spring")
    error.set(yscale="log", xlabel="h / sqrt(m/k)", ylabel="relative\ndifference", xlim=(0.009, 110))
    style.plain_log(error.xaxis)
    figure.legend(handles=handles, loc="outside right upper", title="line: spectral radius\nmarker: simulation")
    return figure


def _threshold(axis, stability) -> None:
    """Mark the step at which simulations become unstable, for schemes with such a step."""
    finite = stability[np.isfinite(stability["blow_up_measured"])]
    for scheme, rows in finite.groupby("scheme"):
        unstable_from, stated = rows[["blow_up_measured", "limit_stated"]].iloc[0]
        axis.axvline(unstable_from, color=style.FAINT, ls=":", lw=1)
        text = f"{_NAMES[scheme]} unstable\nfrom {unstable_from:.4f} (stated limit {stated:.4f})"
        place = (unstable_from, 0.97), (-6, 0), ("data", "axes fraction"), "offset points"
        axis.annotate(text, *place, ha="right", va="top", fontsize=8)


_MODES = {"rigid": ("#0072b2", "o", 7), "linear": ("#009e73", "s", 4), "quadratic": ("#d55e00", "D", 4)}
"""Colour, marker and its size; rigid and linear cost the same, so that one marker must surround the other."""
_SEEN_FROM = np.array([[0.9, 0.43, 0.0], [-0.15, 0.31, 0.94]])
_FROM_SIDE = np.eye(3)[[0, 2]]
"""Directions of pictures, across and up, in space."""


@style.figure("deformation_modes", tables=("deformation_modes",))
def draw_deformation_modes(deformation_modes) -> Figure:
    """Draw a row for each mode and a column for each deformation: the block as it is in grey, and its goals."""
    table = deformation_modes
    deformations = list(dict.fromkeys(table["deformation"]))
    size = (1.7 * len(deformations) + 0.6, 2.5 * len(_MODES))
    figure, axes = style.panels(len(_MODES), len(deformations), size, sharex=True, sharey=True)
    for row, (mode, (colour, _, _)) in zip(axes, _MODES.items(), strict=True):
        for axis, deformation in zip(row, deformations, strict=True):
            group = tables.where(table, deformation=deformation, mode=mode)
            _edges(axis, group, "", _SEEN_FROM, style.FAINT, 1.6)
            _edges(axis, group, "goal_", _SEEN_FROM, colour, 0.7)
            left = group["left"].iloc[0]
            outcome, place = f"misses {percent(left)}" if left > 1e-9 else "follows", ((0.5, 0.0), (0, -2))
            axis.annotate(outcome, *place, "axes fraction", "offset points", ha="center", va="top", fontsize=8)
            axis.set_axis_off()
            axis.set_aspect("equal")
            axis.autoscale()
        row[0].annotate(mode, (0.0, 0.5), xycoords="axes fraction", rotation=90, ha="right", va="center", color=colour)
    for axis, deformation in zip(axes[0], deformations, strict=True):
        axis.set_title(deformation)
    return figure


def _edges(axis, group, prefix: str, view: np.ndarray, colour: str, width: float) -> None:
    """Draw lines between particles that are neighbours at rest, seen along the axes ``view`` (2, 3), across and up.

    prefix : of the columns of their drawn places: "rest_", "goal_" or none
    """
    rest = group[[f"rest_{axis}_m" for axis in "xyz"]].to_numpy()
    places = 100.0 * group[[f"{prefix}{axis}_m" for axis in "xyz"]].to_numpy() @ view.T
    number_at = {tuple(np.round(node, 9)): number for number, node in enumerate(rest)}
    lines = []
    for side in range(3):
        spacings = np.diff(np.unique(np.round(rest[:, side], 9)))
        for node, number in number_at.items():
            neighbour = list(node)
            neighbour[side] += spacings.min() if len(spacings) else 0.0
            if (neighbour_number := number_at.get(tuple(np.round(neighbour, 9)), number)) != number:
                lines.append(places[[number, neighbour_number]])
    axis.add_collection(LineCollection(lines, colors=colour, linewidths=width))


_COLOURS = ("#0072b2", "#009e73", "#d55e00", "#cc79a7", "#e6b400")


@style.figure("clusters", tables=("clusters",))
def draw_clusters(clusters) -> Figure:
    """Draw one column per panel from the side, its particles coloured by displacement, and its rest shape in grey."""
    groups = list(clusters.groupby("clusters"))
    size = (2.0 * len(groups) + 2.6, 4.2)
    figure, (axes,) = style.panels(1, len(groups) + 1, size, width_ratios=[2.0] * len(groups) + [2.4])
    norm = matplotlib.colors.Normalize(0.0, 100.0 * np.linalg.norm(displacement(clusters), axis=1).max())
    places = 100.0 * np.concatenate([clusters[["rest_x_m", "rest_z_m"]], clusters[["x_m", "z_m"]]])
    (left, bottom), (right, top) = places.min(axis=0) - 1.5, places.max(axis=0) + 1.5
    for axis, (count, group), colour in zip(axes, groups, _COLOURS, strict=False):
        _edges(axis, group, "rest_", _FROM_SIDE, style.FAINT, 0.7)
        _edges(axis, group, "", _FROM_SIDE, style.INK, 0.9)
        farther = 100.0 * np.linalg.norm(displacement(group), axis=1)
        colours = {"c": farther, "norm": norm, "cmap": style.DISPLACEMENT, "edgecolors": style.INK}
        dots = axis.scatter(*(100.0 * group[["x_m", "z_m"]].to_numpy().T), s=18, linewidths=0.4, zorder=3, **colours)
        axis.set_title(f"{count} cluster{'s' if count > 1 else ''}\ntip moves {farther.max():.1f} cm", color=colour)
        axis.set(xlim=(left, right), ylim=(bottom, top), aspect="equal", xlabel="x [cm]")
        axis.label_outer()
        sideways = 100.0 * (group["x_m"] - group["rest_x_m"]).groupby(group["rest_z_m"]).mean()  # of each layer
        axes[-1].plot(sideways, 100.0 * sideways.index, color=colour, marker="o", ms=3, label=str(count))
    axes[0].set_ylabel("height [cm]")
    axes[-1].set(xlabel="sideways displacement [cm]", ylabel="height at rest [cm]")
    axes[-1].set_title(f"{clusters['force_n'].iloc[0]:g} N on the top\nof {len(groups[0][1])} particles")
    axes[-1].legend(title="clusters", loc="lower right")
    figure.colorbar(
        dots, ax=axes[:-1], orientation="horizontal", shrink=0.5, aspect=40, label="displacement [cm] (grey: at rest)"
    )
    return figure


_KINDS = {"tetrahedra": "neighbourhoods until\nall are covered", "each_tetrahedron": "one neighbourhood\na tetrahedron"}
_GOALS = {"mean": ("goals averaged", "#8cc4e6"), "sum": ("pulls added", "#0072b2")}


@style.figure("cluster_goals", tables=("cluster_goals",))
def draw_cluster_goals(cluster_goals) -> Figure:
    """Draw the α from which on each variant is unstable, and the largest displacement of the loaded column."""
    figure, ((limits, tips),) = style.panels(1, 2, (8.0, 3.8))
    kinds = list(dict.fromkeys(cluster_goals["kind"]))
    for shift, (goals, (label, colour)) in zip((-0.2, 0.2), _GOALS.items(), strict=True):
        rows = tables.where(cluster_goals, goals=goals).set_index("kind").loc[kinds]
        places = np.arange(len(kinds)) + shift
        measured, stated = (np.minimum(rows[name], 1.0) for name in ("alpha_limit_measured", "alpha_limit"))
        limits.bar(places, measured, 0.36, color=colour, label=label)
        limits.plot(places, stated, "_", color=style.INK, ms=16, label="by the eigenvalue" if goals == "sum" else None)
        for place, limit, height in zip(places, rows["alpha_limit_measured"], measured, strict=True):
            text = f"{limit:.3f}" if np.isfinite(limit) else "none\nup to 1"
            limits.annotate(text, (place, height), (0, 3), textcoords="offset points", ha="center", fontsize=8)
        tips.bar(places, 100.0 * rows["peak_m"], 0.36, color=colour, label=label)
        for place, row in zip(places, rows.itertuples(), strict=True):
            top = (place, 100.0 * row.peak_m)
            tips.annotate(f"α = {row.alpha:.3g}", top, (0, 3), textcoords="offset points", ha="center", fontsize=8)
    names = [
        f"{_KINDS[row.kind]}\n{row.clusters} clusters, {row.clusters_mean:.0f} a particle"
        for row in cluster_goals.drop_duplicates("kind").itertuples()
    ]
    for axis in (limits, tips):
        axis.set_xticks(range(len(kinds)), names)
    limits.set(ylabel="α", title="unstable from this α on", ylim=(0.0, 1.25))
    tips.set(ylabel="displacement of the tip [cm]", title="the column under its load", ylim=(0.0, None))
    tips.margins(y=0.15)
    figure.legend(*limits.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure


_THESIS_MS, _NS = 20.0, 20.0


@style.figure("shape_matching_timing", tables=("shape_matching_timing",))
def draw_shape_matching_timing(shape_matching_timing) -> Figure:
    """Draw objects of 100 particles, one panel for each number of clusters, and one object of many particles."""
    table = shape_matching_timing
    many_objects, one_object = tables.where(table, particles=100), tables.where(table, objects=1)
    counts = sorted(many_objects["clusters"].unique())
    figure, (axes,) = style.panels(1, len(counts) + 1, (2.6 * (len(counts) + 1) + 0.4, 3.9), sharey=True)
    slopes = exponents(table).set_index(["mode", "clusters"])["exponent"]
    for axis, clusters in zip(axes, counts, strict=False):
        title = f"objects of 100 particles,\n{clusters} cluster{'s' if clusters > 1 else ''} each"
        fits = slopes.xs(clusters, level="clusters")
        labels = {mode: style.with_power(mode, power) for mode, power in fits.items()}
        _curves(axis, tables.where(many_objects, clusters=clusters), title, labels)
        if clusters == HEADLINE["clusters"]:
            _mark_headline(axis, headline(table))
    largest = tables.where(one_object, clusters=HEADLINE["clusters"])
    _curves(axes[-1], largest, f"one object,\n{HEADLINE['clusters']} clusters", {mode: mode for mode in _MODES})
    axes[0].set_ylabel("time of a step on one core [ms]")
    axes[0].set_ylim(table["ms_per_step"].min() / 12, 60)
    for axis in axes:
        style.plain_log(axis.xaxis, axis.yaxis)
    return figure


def _curves(axis, rows, title: str, labels: dict[str, str]) -> None:
    for mode, label in labels.items():
        colour, marker, size = _MODES[mode]
        curve = tables.where(rows, mode=mode).sort_values("all_particles")
        axis.loglog(curve["all_particles"], curve["ms_per_step"], color=colour, marker=marker, ms=size, label=label)
    counts = np.array([rows["all_particles"].min(), rows["all_particles"].max()])
    axis.loglog(counts, 1e-6 * _NS * counts, color=style.FAINT, lw=0.8, ls=":", label=f"{_NS:g} ns per particle")
    axis.set(title=title, xlabel="total number of particles, n")
    axis.legend(loc="lower right")


def _mark_headline(axis, milliseconds: float) -> None:
    """Mark the thesis' time for 100 quadratic objects, and this machine's."""
    particles = HEADLINE["objects"] * HEADLINE["particles"]
    axis.plot(particles, _THESIS_MS, "*", color=style.INK, ms=9)
    text = f"thesis: {_THESIS_MS:g} ms\nhere: {milliseconds:.2g} ms"
    thesis_point = (particles, _THESIS_MS)
    axis.annotate(text, thesis_point, (-8, 0), textcoords="offset points", ha="right", va="center", fontsize=8)
    axis.plot([particles] * 2, [milliseconds, _THESIS_MS], color=style.INK, lw=0.8, ls="--")


_SHADES = ("#c5e29f", "#8cc63f", "#3f6b12")  # the hue of body springs in style.EFFECTS, darker the stiffer


@style.figure("body_springs", tables=("body_springs",))
def draw_body_springs(body_springs) -> Figure:
    """Draw the displacement at the end of the hold over the distance from the poke, and the largest one over time."""
    figure, ((by_distance, by_time),) = style.panels(1, 2, (9.5, 3.9))
    handles, shades = [], iter(_SHADES)
    for (case, stiffness), rows in body_springs.groupby(["case", "body_springs_n_m"], sort=False):
        colour, dashes, label = _look(case, stiffness, shades)
        end = held(rows)
        peak = end["max_displacement_m"].max()
        by_distance.plot(1e3 * end["distance_m"], 1e3 * end["mean_displacement_m"], "o", ls=dashes, ms=4, color=colour)
        shares = rows.groupby("time_s")["max_displacement_m"].max() / peak
        by_time.plot(shares.index, 100 * shares, ls=dashes, color=colour)
        share = end["moved"].sum() / end["nodes"].sum()
        label = f"{label}\n{100 * share:.0f} % of nodes moved, {1e3 * peak:.1f} mm"
        handles.append(Line2D([], [], color=colour, ls=dashes, marker="o", ms=4, label=label))
    released = body_springs.loc[body_springs["phase"] == "hold", "time_s"].max()
    by_time.axvline(released, color=style.FAINT, ls=":", lw=1)
    place = (released, 0.01), (-3, 2), ("data", "axes fraction"), "offset points"
    by_time.annotate("release", *place, rotation=90, ha="right", va="bottom", fontsize=7)
    by_distance.set(xlabel="rest distance from the poke [mm]", ylabel="mean displacement [mm]", title="during the hold")
    by_time.set(xlabel="time [s]", ylabel="largest displacement [% of that during the hold]", title="over time")
    by_time.set(yscale="log", ylim=(1e-2, 300))
    style.plain_log(by_time.yaxis)
    title = "moved: by more than 10 % of the largest"
    figure.legend(handles=handles, loc="outside right upper", labelspacing=0.9, title=title)
    return figure


def _look(case: str, stiffness: float, unused_shades) -> tuple[str, str, str]:
    """Return colour, line style and label of a case."""
    if case == "body_springs":
        return next(unused_shades), "-", f"body springs, {stiffness:g} N/m per node"
    return {
        "none": (style.INK, "-", "surface springs only"),
        "dampers_only": (style.FAINT, "--", "dampers only, without body springs"),
    }[case]


@style.figure("maxwell_creep", tables=("maxwell_creep",))
def draw_maxwell_creep(maxwell_creep) -> Figure:
    """Draw the displacement over time, simulated and in closed form, and below the difference of the two."""
    table = maxwell_creep
    figure, ((moved,), (error,)) = style.panels(2, 1, (6.5, 4.6), sharex=True, height_ratios=(3, 1))
    times, colour = table["time_s"], style.effect_colour("maxwell")
    moved.plot(times, 1e3 * table["springs_m"], color=style.FAINT, ls="--", label="springs alone")
    moved.plot(times, 1e3 * table["closed_m"], color=style.INK, lw=1.2, label="closed solution")
    moved.plot(times, 1e3 * table["creep_m"], "o", color=colour, ms=4, mec="white", mew=0.4, label="simulated")
    error.axhline(0.0, color=style.FAINT, lw=0.8)
    largest = table["closed_m"].abs().max()
    error.plot(times, 100.0 * (table["creep_m"] - table["closed_m"]) / largest, "o-", color=colour, ms=3)
    moved.set(ylabel="displacement [mm]", title=spaced(table["scene"].iloc[0]))
    error.set(xlabel="time [s]", ylabel="difference\n[% of largest]")
    moved.legend()
    return figure
