"""The work–precision diagram shows every model, its failures and the front."""

import re

import numpy as np
import pandas as pd
import pytest
from fixtures.drawn import texts

from palpate.figures import style, tables
from palpate.figures.model_looks import look
from palpate.figures.tradeoff import work_precision


def test_every_model_has_its_curve_and_the_front_its_numbers(advised_tables, tmp_path):
    figure = work_precision.draw(*advised_tables, scene="liver_small")
    written = texts(figure)
    for model in ("springs", "shape_matching", "linear_fem", "detail_correction", "pod_rbf", "fem_coarse", "fem_fine"):
        assert look(model).label in written
    budgets = {"0.01 ms:\nnone", "1 ms:\nlinear fine\nFEM", "16.7 ms:\ncorrected\ncoarse FEM", "1000 ms:\nfine FEM"}
    assert budgets <= set(written)
    assert "failed: springs (iterations=1) on 2 of 12" in written
    assert any("fine mesh itself, 0.6" in text for text in written)
    # coarse FEM is clearly slower than ours and clearly less wrong; ours and POD + RBF are tied
    on_front = [re.match(r"\d  (.*)\n", text).group(1) for text in written if re.match(r"\d  ", text)]
    assert on_front == [
        "linear fine FEM",
        "POD + RBF (modes=8)",
        "corrected coarse FEM (samples=60)",
        "coarse FEM (iterations=8)",
        "fine FEM (tolerance=1e-08)",
    ]
    style.save(figure, tmp_path / "work_precision")


def test_what_failed_is_hollow_and_on_no_front(advised_tables):
    settings, advised = advised_tables
    axis = work_precision.draw(settings, advised, scene="liver_small").axes[0]
    hollow = [line for line in axis.lines if line.get_markerfacecolor() == "white"]
    assert [line.get_xdata()[0] for line in hollow] == [pytest.approx(0.1)]
    nothing = tables.where(settings, scene="liver_small").assign(failures=0)
    columns = ["failures", "rmse_of_peak", "online_median_s", "online_p95_s"]
    nothing.loc[nothing["model"] == "detail_correction", columns] = [12, np.nan, np.nan, np.nan]
    assert "detail_correction" not in set(work_precision.front_rows(nothing)["model"])
    written = texts(work_precision.draw(nothing, advised, scene="liver_small"))
    failed = ", ".join(f"corrected coarse FEM (samples={count}) on 12 of 12" for count in (10, 60))
    assert f"failed: {failed}" in written


def test_all_but_exact_answers_are_drawn_at_the_edge(advised_tables):
    axis = work_precision.draw(*advised_tables, scene="liver_small").axes[0]
    drawn = np.concatenate([line.get_ydata() for line in axis.lines if line.get_marker() == look("fem_fine").marker])
    assert set(drawn) == {work_precision.LEAST}


def test_own_models_are_drawn_wherever_they_come(advised_tables):
    settings, advised = (
        table.replace({"detail_correction": "mine", "shape_matching": "nearest", "linear_fem": "other"})
        for table in advised_tables
    )
    assert {"mine", "nearest", "other"} <= set(texts(work_precision.draw(settings, advised, scene="liver_small")))


def test_the_blends_of_paper_1_share_a_line_of_the_legend(advised_tables):
    settings, advised = advised_tables
    rows = tables.where(settings, model="pod_rbf")
    names = ["unordered_signed", "unordered_clipped", "ordered_signed", "framed_nonnegative_b"]
    settings = pd.concat([settings, *(rows.assign(model=name) for name in names)])
    figure = work_precision.draw(settings, advised, scene="liver_small")
    blends = [text.get_text() for text in figure.legends[0].get_texts() if text.get_text().startswith("paper 1")]
    assert blends == [
        "paper 1: unordered",
        "paper 1: contact-ordered",
        "paper 1: contact-ordered, own frame",
    ]
