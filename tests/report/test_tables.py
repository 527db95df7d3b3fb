"""A table that is not right is named."""

import pytest

from palpate.errors import InputError
from palpate.report import tables


def test_reads_what_it_needs_and_more(results_folder):
    path = results_folder.path / "tables" / "claims.csv"
    path.write_text(path.read_text().replace("verdict", "verdict,extra").replace("confirmed", "confirmed,1"))
    assert "extra" in tables.read(path)


def test_missing_columns_are_named(tmp_path):
    (tmp_path / "claims.csv").write_text("claim,ours,section,premise,study\na,b,c,d,e\n")
    with pytest.raises(InputError, match=r"claims\.csv lacks the column\(s\) paper, published, verdict"):
        tables.read(tmp_path / "claims.csv")


@pytest.mark.parametrize("content", ["", "paper,section,claim,premise,published,ours,verdict,study\n"])
def test_an_empty_table_is_refused(tmp_path, content):
    (tmp_path / "claims.csv").write_text(content)
    with pytest.raises(InputError, match=r"claims\.csv"):
        tables.read(tmp_path / "claims.csv")


def test_of_a_run_of_which_no_paper_claims_anything_the_claims_alone_may_be_empty(tmp_path):
    for name in ("claims", "truth"):
        (tmp_path / f"{name}.csv").write_text(",".join(tables.columns(name)) + "\n")
    assert tables.read_all(tmp_path, ["claims"])["claims"].empty
    with pytest.raises(InputError, match=r"truth\.csv has no rows"):
        tables.read_all(tmp_path, ["claims", "truth"])
