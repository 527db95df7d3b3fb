"""Tables and captions become HTML that can be read on any screen."""

import pandas as pd
import pytest

from palpate.report import markup
from palpate.table import Table


@pytest.mark.parametrize(
    ("values", "number"),
    [
        (["5 ms", "20\u00a0µs", "<\u00a00.001\u00a0%"], True),
        (["6 % [5 %, 7 %]", "4 % (fitted)"], True),
        (["-0.0959", "1.2e-05"], True),
        ([1, None], True),
        (["0 crossing pairs missed, 8 reported wrongly"], False),
        (["4.7 times as fast"], False),
        (["none"], False),
    ],
)
def test_columns_of_quantities_are_aligned_as_numbers(values, number):
    assert ('<th scope="col" class=number>' in markup.table(pd.DataFrame({"a": values}), "")) == number


def test_long_cells_break_into_lines_and_short_ones_do_not():
    text = markup.table(pd.DataFrame({"a": ["short", "x" * 30, "x" * 50, "x" * 130]}), "")
    assert [f'<td class="{width}">' in text for width in ("mid", "long", "text")] == [True] * 3
    assert "<td>short</td>" in text


def test_an_outcome_gets_its_mark():
    text = markup.table(pd.DataFrame({"verdict": ["confirmed", "refuted", "not testable: tied"]}), "")
    assert '<td class="good">' in text and '<td class="bad">' in text and '<td class="open' in text


def test_what_is_folded_says_what_it_holds():
    text = markup.folded(pd.DataFrame({"a_m": [1.0]}), Table("lengths", "The length of <things>.", "a_m: of each"))
    assert "<summary><b>Table lengths</b>, 1 rows. The length of &lt;things&gt;.</summary>" in text
    assert "results/tables/lengths.csv" in text and "<th" in text
    assert "data-packed" in markup.folded(pd.DataFrame({"a": range(100)}), Table("lengths", "", "a:"))
    assert markup.fold("more", "inside", opened=True) == "<details open><summary>more</summary>\ninside\n</details>"
