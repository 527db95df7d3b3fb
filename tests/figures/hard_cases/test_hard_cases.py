"""The matrix of hard cases and its sentences say what the table says."""

import pandas as pd
import pytest
from matplotlib.colors import to_hex

from palpate.errors import InputError
from palpate.figures import tables
from palpate.figures.hard_cases import hard_cases
from palpate.report.parts import hard_cases_numbers


@pytest.fixture
def table():
    rows = [
        ["fem", "locking", "level_0", "stable", 0.4, True, ""],
        ["fem", "locking", "level_2_softer", "stable", 0.04, True, ""],
        ["fem", "no_anchor", "fem", "refused", None, True, "give it anchors."],
        ["contact", "drop", "fem", "nan", None, False, "not finite"],
        ["kernel", "one_sample", "detail_correction", "wrong", 2.0, False, ""],
    ]
    table = pd.DataFrame(rows, columns=["family", "case", "model", "outcome", "value", "passed", "message"])
    return table.assign(source="", scene="", measure="", bound=1.0, declared="stable")[
        tables.COLUMNS["hard_cases"].split()
    ]


def test_a_cell_for_each_run_in_its_outcomes_colour(table):
    figure = hard_cases.draw(table)
    assert len(figure.axes) == 3
    drawn = [to_hex(patch.get_facecolor()) for axis in figure.axes for patch in axis.patches]
    expected = ["stable", "stable", "refused", "wrong", "nan"]
    assert drawn == [hard_cases.LOOKS[outcome].colour for outcome in expected]
    assert [sum(line.get_marker() == "x" for line in axis.lines) for axis in figure.axes] == [0, 1, 1]
    assert [label.get_text() for label in figure.axes[0].get_yticklabels()] == ["locking", "no anchor"]


def test_families_that_were_not_tried_leave_no_room(table):
    assert len(hard_cases.draw(table[table["family"] == "kernel"]).axes) == 1


def test_an_unknown_outcome_has_no_colour(table):
    with pytest.raises(InputError, match="outcome maybe has no colour"):
        hard_cases.draw(table.replace({"outcome": {"nan": "maybe"}}))


def test_sentences_count_outcomes(table):
    found = hard_cases_numbers.numbers({"hard_cases": table})
    assert found["headline_hard_cases"] == (
        "4 hard cases, 5 runs: 2 wrong or not a number; 2 went otherwise than declared beforehand."
    )
    assert found["hard_cases_outcomes"] == "2 stable, 1 refused, 1 nan, 1 wrong"
    assert found["hard_cases_locking"].replace("\u00a0", " ") == "40 % level 0, 4 % level 2 softer"
    untried = hard_cases_numbers.numbers({"hard_cases": table[table["family"] == "kernel"]})
    assert untried["hard_cases_locking"] == "not run"
