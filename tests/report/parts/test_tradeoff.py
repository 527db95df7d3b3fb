"""Sentences and captions about accuracy and time follow from the tables."""

import re
from pathlib import Path

import pytest

from palpate.figures import tables
from palpate.report import page as report
from palpate.report.numbers import numbers
from palpate.report.parts.tradeoff import sentence

CAPTIONS = Path(__file__).parents[3] / "workflow" / "report"


@pytest.fixture
def liver(advised_tables):
    return [tables.where(table, scene="liver_small") for table in advised_tables]


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


def test_captions_get_their_numbers(advised_tables):
    settings, advised = advised_tables
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


def test_the_report_shows_all_of_it(advised_tables, tmp_path):
    (tmp_path / "tables").mkdir()
    (tmp_path / "figures").mkdir()
    for name, table in zip(("accuracy_vs_time", "advice"), advised_tables, strict=True):
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
