"""Clusters to the letter of the thesis beside fewer and averaged ones: how far α may go, and how far a column bends."""

import numpy as np
from matplotlib.figure import Figure

from palpate.report import style

TABLES = ("cluster_goals",)
_KINDS = {"tetrahedra": "neighbourhoods until\nall are covered", "each_tetrahedron": "one neighbourhood\na tetrahedron"}
_GOALS = {"mean": ("goals averaged", "#8cc4e6"), "sum": ("pulls added", "#0072b2")}


@style.styled
def draw(cluster_goals) -> Figure:
    """Draw the α from which on each variant is unstable, and the largest displacement of the loaded column.

    cluster_goals : the table of this name
    """
    figure = Figure(figsize=(8.0, 3.8), layout="constrained")
    limits, tips = figure.subplots(1, 2)
    kinds = list(dict.fromkeys(cluster_goals["kind"]))
    for shift, (goals, (label, colour)) in zip((-0.2, 0.2), _GOALS.items(), strict=True):
        rows = cluster_goals[cluster_goals["goals"] == goals].set_index("kind").loc[kinds]
        places = np.arange(len(kinds)) + shift
        found, stated = (np.minimum(rows[name], 1.0) for name in ("alpha_limit_measured", "alpha_limit"))
        limits.bar(places, found, 0.36, color=colour, label=label)
        limits.plot(places, stated, "_", color=style.INK, ms=16, label="by the eigenvalue" if goals == "sum" else None)
        for place, limit, bound in zip(places, rows["alpha_limit_measured"], found, strict=True):
            text = f"{limit:.3f}" if np.isfinite(limit) else "none\nup to 1"
            limits.annotate(text, (place, bound), (0, 3), textcoords="offset points", ha="center", fontsize=8)
        tips.bar(places, 100.0 * rows["peak_m"], 0.36, color=colour, label=label)
        for place, (_, row) in zip(places, rows.iterrows(), strict=True):
            tips.annotate(f"α = {row['alpha']:.3g}", (place, 100.0 * row["peak_m"]), (0, 3), ha="center", fontsize=8,
                          textcoords="offset points")  # fmt: skip
    for axis in (limits, tips):
        shared = cluster_goals.drop_duplicates("kind").set_index("kind").loc[kinds]
        names = [
            f"{_KINDS[kind]}\n{row['clusters']} clusters, {row['clusters_mean']:.0f} a particle"
            for kind, row in shared.iterrows()
        ]
        axis.set_xticks(range(len(kinds)), names)
    limits.set(ylabel="α", title="unstable from this α on", ylim=(0.0, 1.25))
    tips.set(ylabel="displacement of the tip [cm]", title="the column under its load", ylim=(0.0, None))
    tips.margins(y=0.15)
    figure.legend(*limits.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure
