"""Feature vectors of the same press at two nodes, unordered and ordered (paper 1's figure 2)."""

import numpy as np
from matplotlib.figure import Figure

from palpate.report import style, tables

TABLES = ("feature_vectors", "premise_bodies")


@style.styled
def draw(feature_vectors, premise_bodies) -> Figure:
    """Draw a row for the most global and the most local premise, and a column for each kind of feature.

    feature_vectors, premise_bodies : the tables of these names
    Lines are the two presses; a title has the distance of their vectors over the length of the first.
    """
    about = premise_bodies.sort_values("moved_share", ascending=False, kind="stable")
    rows = list(dict.fromkeys([about["premise"].iloc[0], about["premise"].iloc[-1]]))
    figure = Figure(figsize=(10, 2.1 * len(rows) + 0.8), layout="constrained")
    grid = figure.subplots(len(rows), len(style.FEATURES), squeeze=False)
    for axes, premise in zip(grid, rows, strict=True):
        moved = about.set_index("premise").loc[premise, "moved_share"]
        for axis, features in zip(axes, style.FEATURES, strict=True):
            _vectors(axis, tables.where(feature_vectors, premise=premise, features=features), features)
        axes[0].set_ylabel(f"{premise.replace('_', ' ')}\n({100 * moved:.0f} % moves)\ndisplacement / peak")
    for axis in grid[-1]:
        axis.set_xlabel("place in the vector")
    figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure


def _vectors(axis, rows, features) -> None:
    """Draw the two vectors of one kind of feature, and their distance."""
    colours = (style.look(f"{features}_nonnegative_a").colour, style.INK)
    vectors = [press.sort_values(["node", "axis"])["share_of_peak"].to_numpy() for _, press in rows.groupby("press")]
    for i, (vector, colour) in enumerate(zip(vectors, colours, strict=True)):
        style_of = {"lw": 1.0 if len(vector) > 60 else 1.5, "ls": "-" if i == 0 else "--"}
        axis.plot(np.arange(len(vector)), vector, color=colour, label=("one node", "another node")[i], **style_of)
    apart = np.linalg.norm(vectors[1] - vectors[0]) / np.linalg.norm(vectors[0])
    axis.set_title(f"{style.FEATURES[features][0]}\n{apart:.2f} apart")
