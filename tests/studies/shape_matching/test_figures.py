"""Every case of the poke has its curve and its share of moved nodes."""

import numpy as np
import pandas as pd
import pytest
from fixtures.drawn import texts

from palpate.report import tables
from palpate.studies.shape_matching import figures


def test_every_case_is_named_with_its_share_of_moved_nodes(shape_matching_results):
    table = shape_matching_results["body_springs"]
    damped = table[table["case"] == "none"].assign(case="dampers_only")
    labels = [t.get_text() for t in figures.draw_body_springs(pd.concat([table, damped])).legends[0].get_texts()]
    assert len(labels) == 3
    held = tables.where(table, case="none", phase="hold", time_s=1.0)
    share = held["moved"].sum() / held["nodes"].sum()
    assert labels[0].startswith(f"surface springs only\n{100 * share:.0f} % of nodes moved")


def test_bars_are_what_was_measured(shape_matching_results):
    limits, tips = figures.draw_cluster_goals(shape_matching_results["cluster_goals"]).axes
    assert [bar.get_height() for bar in limits.patches] == pytest.approx([1.0, 1.0, 1.0, 0.151])
    assert [bar.get_height() for bar in tips.patches] == pytest.approx([10.0, 12.0, 9.0, 11.0])
    said = [text.get_text() for text in limits.texts]
    assert said.count("none\nup to 1") == 3 and "0.151" in said


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


def test_each_block_says_what_its_mode_misses(shape_matching_results):
    table = shape_matching_results["deformation_modes"]
    figure = figures.draw_deformation_modes(table)
    said = [text for axis in figure.axes for text in texts(axis) if "misses" in text or text == "follows"]
    assert said == ["misses 90\u00a0%"] * 2 + ["follows", "misses 50\u00a0%"] + ["follows"] * 2
    assert [axis.get_title(loc="left") for axis in figure.axes[:2]] == ["linear", "bent"]


def test_the_step_at_which_it_becomes_unstable_is_named(shape_matching_results):
    table = shape_matching_results["integrator_stability"]
    written = "\n".join(texts(figures.draw_integrator_stability(table)))
    assert f"from {table['blow_up_measured'].min():.4f} (stated limit 2.0000)" in written
    assert "goal positions, α = 0.5" in written


def test_both_curves_and_their_difference_are_drawn(shape_matching_results):
    table = shape_matching_results["maxwell_creep"]
    moved, error = figures.draw_maxwell_creep(table).axes
    springs, closed, simulated = (line.get_ydata() for line in moved.lines)
    assert simulated.max() == pytest.approx(1e3 * table["creep_m"].max())
    assert closed.max() == pytest.approx(10.0) and springs.max() == pytest.approx(10.0)
    assert error.lines[1].get_ydata() == pytest.approx([1.0] * len(table))


def test_the_figure_marks_the_thesis(shape_matching_results):
    table = shape_matching_results["shape_matching_timing"]
    figure = figures.draw_shape_matching_timing(table.assign(ms_per_step=3.21e-5 * table["all_particles"]))
    written = [text.get_text() for axis in figure.axes for text in axis.texts]
    assert any("20 ms" in line and "here: 0.32 ms" in line for line in written)
    assert len(figure.axes) == table["clusters"].nunique() + 1
