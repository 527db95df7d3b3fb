"""What is drawn and said about accuracy and time follows from the tables."""

import io
import re
from pathlib import Path

import matplotlib.text
import numpy as np
import pandas as pd
import pytest

from palpate.evaluation.tradeoff.advice import advise
from palpate.figures import style, tables
from palpate.figures.model_looks import label, look
from palpate.figures.tradeoff import advice, break_even, work_precision
from palpate.report import page as report
from palpate.report.numbers import numbers
from palpate.report.parts.tradeoff import sentence

CAPTIONS = Path(__file__).parents[2] / "workflow" / "report"


def texts(figure):
    """Everything that is written in a figure."""
    return [text.get_text() for text in figure.findobj(matplotlib.text.Text) if text.get_text()]


@pytest.fixture(scope="module")
def found(trade_off):
    """Both tables, as they are read from their files."""
    settings, samples = trade_off
    rows = [
        advise(settings[settings["scene"] == scene], errors, [0.01, 1, 16.7, 1000], [0.05, 1e-12])
        for scene, errors in samples.items()
    ]
    rows.append(rows[0].assign(scene="press", setting="step_s=0.01", error_low=np.nan, error_high=np.nan))  # it moves
    again = (io.StringIO(table.to_csv(index=False)) for table in (settings, pd.concat(rows)))
    return tuple(pd.read_csv(text) for text in again)


@pytest.fixture
def liver(found):
    return [tables.where(table, scene="liver_small") for table in found]


def test_every_model_has_its_curve_and_the_front_its_numbers(liver, tmp_path):
    figure = work_precision.draw(*liver)
    written = texts(figure)
    for model in ("springs", "shape_matching", "linear_fem", "detail_correction", "pod_rbf", "fem_coarse", "fem_fine"):
        assert look(model).label in written
    advised = {"0.01 ms": "none", "1 ms": "linear fine FEM", "16.7 ms": "detail correction", "1000 ms": "fine FEM"}
    assert {f"{budget}:\n{model}" for budget, model in advised.items()} <= set(written)
    assert "failed: springs (iterations=1) on 2 of 12" in written
    assert any("fine mesh itself, 0.6" in text for text in written)
    # coarse FEM is clearly slower than detail correction and clearly less wrong; that and POD + RBF are tied
    on_front = [re.match(r"\d  (.*)\n", text).group(1) for text in written if re.match(r"\d  ", text)]
    assert on_front == [
        "linear fine FEM",
        "POD + RBF (modes=8)",
        "detail correction (samples=60)",
        "coarse FEM (iterations=8)",
        "fine FEM (tolerance=1e-08)",
    ]
    style.save(figure, tmp_path / "work_precision")


def test_what_failed_is_hollow_and_on_no_front(liver):
    settings, advised = liver
    axis = work_precision.draw(settings, advised).axes[0]
    hollow = [line for line in axis.lines if line.get_markerfacecolor() == "white"]
    assert [line.get_xdata()[0] for line in hollow] == [pytest.approx(0.1)]
    nothing = settings.assign(failures=0)
    columns = ["failures", "rmse_of_peak", "online_median_s", "online_p95_s"]
    nothing.loc[nothing["model"] == "detail_correction", columns] = [12, np.nan, np.nan, np.nan]
    assert "detail_correction" not in set(work_precision.front_rows(nothing)["model"])
    written = texts(work_precision.draw(nothing, advised))
    assert "failed: detail correction (samples=10) on 12 of 12, detail correction (samples=60) on 12 of 12" in written


def test_all_but_exact_answers_are_drawn_at_the_edge(liver):
    axis = work_precision.draw(*liver).axes[0]
    drawn = np.concatenate([line.get_ydata() for line in axis.lines if line.get_marker() == look("fem_fine").marker])
    assert set(drawn) == {work_precision.LEAST}


def test_advice_shows_the_advised_and_the_next_best_in_each_budget(found):
    settings, advised = found
    figure = advice.draw(advised, settings)
    titles = [axis.get_title("left") for axis in figure.axes]
    assert titles == ["within 0.01 ms", "within 1 ms", "within 16.7 ms", "within 1000 ms"]
    none, first, *_ = ([text.get_text() for text in axis.texts] for axis in figure.axes)
    assert none == ["none", "none"]
    assert first == ["shape matching: 4×", "linear fine FEM"] * 2


def test_preparing_pays_where_the_table_says(found):
    settings, advised = found
    axis = break_even.draw(settings, advised).axes[0]
    dots = {line.get_xdata()[0]: line.get_ydata()[0] for line in axis.lines if line.get_marker() == "o"}
    offline, online = 40.0, 5e-3
    answers = offline / (0.4 - online)
    assert {round(x): round(y) for x, y in dots.items()}[round(answers)] == round(0.4 * answers)  # what fine FEM takes
    named = [text.get_text() for text in axis.get_legend().get_texts()]
    assert named[0].startswith("fine FEM (tolerance=1e-08)") and len(named) == 3


def test_sentences_tell_model_error_time_and_rival(liver):
    _, advised = liver
    told = [sentence(row).replace("\u00a0", " ") for _, row in advised.iterrows()]
    assert told[0].startswith("Within 0.01 ms: none, as the fastest setting, linear_fem, takes 0.012 ms")
    assert told[1].startswith("Within 1 ms: linear fine FEM, 5 % of the peak off (")
    assert told[1].endswith(
        "99 % of the budget to spare; shape matching (steps=30), the next best model, is 4 times as wrong."
    )
    assert "0.4 % of the peak off" in told[2] and "in 6 ms at the 95th percentile, 64 % of the budget" in told[2]
    assert "is 200 times as wrong" in told[3]
    assert told[4].startswith("At most 5 % wrong: detail correction (samples=60)") and told[4].endswith(
        "the next best model, is on a par."
    )


def test_captions_get_their_numbers(found):
    settings, advised = found
    said = numbers({"accuracy_vs_time": settings, "advice": advised}, {}, ["tradeoff"], [])
    said = {name: text.replace("\u00a0", " ") for name, text in said.items()}
    assert (said["tradeoff_models"], said["tradeoff_settings"]) == ("7", "16")
    assert said["tradeoff_failures"].startswith("2 failed on at least one sample")
    assert said["tradeoff_truth"] == "liver small 0.6 %; own large 6 %"
    assert "Within 1 ms linear fine FEM (2 of 2 scenes, 5 % to 50 % of the peak off)" in said["headline_tradeoff"]
    assert said["headline_tradeoff"].startswith("Within 0.01 ms none fits (2 of 2 scenes)")
    assert (
        "liver_small: within 1 ms shape matching is 4 times as wrong, within 16.7 ms POD + RBF is on a par"
        in said["factors"]
    )


def test_the_report_shows_all_of_it(found, tmp_path):
    (tmp_path / "tables").mkdir()
    (tmp_path / "figures").mkdir()
    for name, table in zip(("accuracy_vs_time", "advice"), found, strict=True):
        table.to_csv(tmp_path / "tables" / f"{name}.csv", index=False)
    names = ["work_precision_liver_small", "work_precision_own_large", "advice", "break_even"]
    for name in names:
        for suffix in ("svg", "png"):
            (tmp_path / "figures" / f"{name}.{suffix}").write_text("<svg></svg>")
    report.write(tmp_path, CAPTIONS, tmp_path / "report.html", ["tradeoff"], [], [])
    page = (tmp_path / "report.html").read_text(encoding="utf-8").replace("\u00a0", " ")
    assert [name for name in names if f'<figure id="{name}">' in page] == names
    assert "<li>Within 1 ms: linear fine FEM, 5 % of the peak off" in page
    table = page[page.index("What to take for each limit") :]
    assert "<td>none</td>" in table and "<td>detail correction (samples=60)</td>" in table
    assert not re.search(r"\{[a-z_]+\}", page.split("</style>")[1].split("<script>")[0])


def test_own_models_are_drawn_wherever_they_come(found):
    renamed = {"detail_correction": "mine", "shape_matching": "nearest", "linear_fem": "other"}
    settings, advised = (table.replace(renamed) for table in found)
    assert "nearest" in "".join(texts(advice.draw(advised, settings)))
    assert {"mine", "nearest", "other"} <= set(
        texts(work_precision.draw(*(tables.where(t, scene="liver_small") for t in (settings, advised))))
    )


def test_own_models_have_a_look_too():
    assert look("my_model") == look("my_model") and look("my_model").label == "my model"
    assert label("my_model", "size=3") == "my model (size=3)" and label("my_model", "default") == "my model"
