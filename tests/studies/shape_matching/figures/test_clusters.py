"""Each column of clusters is drawn with the displacement of its tip."""

import numpy as np

from palpate.studies.shape_matching import figures


def test_the_figure_shows_each_column_and_how_far_it_moves(shape_matching_results):
    table = shape_matching_results["clusters"]
    figure = figures.draw_clusters(table)
    columns = table.groupby("clusters")
    assert len(figure.axes) == len(columns) + 2  # the columns, their profiles and a colour bar
    for axis, (count, group) in zip(figure.axes, columns, strict=False):
        moved = np.linalg.norm(group[["x_m", "y_m", "z_m"]].to_numpy() - group.filter(like="rest_").to_numpy(), axis=1)
        written = axis.get_title(loc="left")
        assert written.startswith(f"{count} cluster") and f"{100 * moved.max():.1f} cm" in written
        assert len(axis.collections[0].get_offsets()) == len(group)
