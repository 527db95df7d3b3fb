"""A number of README that is not in the tables of a run is found."""

import pandas as pd
import pytest
import yaml

from palpate.errors import InputError
from palpate.report.readme import agrees, look_up, untraced, wrong

MODELS = pd.DataFrame({"model": ["a", "b", "b"], "error": [0.0137, 0.021, 0.043], "samples": [15, 15, 15]})


@pytest.fixture
def docs(tmp_path):
    def write(*traced):
        entries = {"traced": traced, "given": [{"says": "Paper 1", "why": "a name"}]}
        (tmp_path / "readme.yaml").write_text(yaml.safe_dump(entries))
        MODELS.to_csv(tmp_path / "claims.csv", index=False)
        return tmp_path

    return write


def entry(says, take, of="100 * error", **more):
    return {"says": says, "table": "claims", "of": of, "take": take} | more


def test_numbers_are_looked_up_and_compared_as_written(docs):
    folder = docs(
        entry("of 1.4 % here", ["only"], where="model == 'a'"),
        entry("2 to 5 %", ["min", "max"], where="model == 'b'"),
        entry("15 presses", ["only"], of="samples"),
        entry("2 settings", ["count"], where="model == 'b'"),
    )
    rows = look_up(folder, folder)
    assert rows["found"].tolist() == pytest.approx([1.37, 2.1, 4.3, 15.0, 2.0])
    (line,) = wrong(rows)
    assert line == "README says 5 in '2 to 5 %', and the run has 4.3"
    assert untraced("Paper 1 has an error of 1.4 % here, `7` and 8.", folder)[0].endswith("and 8.")


def test_a_query_without_a_row_or_with_several_values_is_refused(docs):
    folder = docs(entry("of 1.4 %", ["only"], where="model == 'c'"))
    with pytest.raises(InputError, match="is found in no row of claims"):
        look_up(folder, folder)
    folder = docs(entry("of 1.4 %", ["only"]))
    with pytest.raises(InputError, match="has 3 values; take min, median or max"):
        look_up(folder, folder)


def test_a_number_agrees_if_it_rounds_to_what_is_written():
    assert agrees("1.4", 1.35) and agrees("1.4", 1.4499) and not agrees("1.4", 1.46)
    assert agrees("298", 297.7) and not agrees("298", 297.4)
