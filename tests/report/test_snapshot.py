"""The snapshot shows what a run's report shows and cites a commit that exists; README has the numbers of its tables."""

import subprocess

import pandas as pd
import pytest
import yaml

from palpate.errors import InputError
from palpate.report import snapshot
from palpate.report.snapshot import agrees, look_up, untraced, wrong


@pytest.fixture
def results(tmp_path):
    folder = tmp_path / "results"
    for name in ("tables", "figures"):
        (folder / name).mkdir(parents=True)
    (folder / "figures/law.png").write_bytes(b"law")
    (folder / "report.md").write_text("## Laws\n\n![law](figures/law.png)\n")
    return folder


def docs(folder):
    (folder / "docs").mkdir(exist_ok=True)
    return folder / "docs"


def commit(folder, name):
    pd.DataFrame({"commit": [name]}).to_csv(folder / "tables/accuracy_vs_time.csv", index=False)


def test_the_page_has_the_report_and_its_pictures(results, tmp_path):
    page = docs(tmp_path)
    (page / "results").mkdir()
    (page / "results/stale.png").write_bytes(b"")
    snapshot.write(results, page)
    text = (page / "results.md").read_text(encoding="utf-8")
    assert text.endswith("## Laws\n\n![law](results/law.png)\n")
    assert [path.name for path in (page / "results").iterdir()] == ["law.png"]


def test_a_picture_that_is_missing_is_named(results, tmp_path):
    (results / "figures/law.png").unlink()
    with pytest.raises(InputError, match=r"law\.png is missing"):
        snapshot.write(results, docs(tmp_path))


def test_a_commit_that_the_repository_lacks_is_refused(results, tmp_path):
    git = ["git", "-C", str(tmp_path), "-c", "user.name=a", "-c", "user.email=a@b"]
    subprocess.run([*git, "init", "-q"], check=True)
    subprocess.run([*git, "commit", "-q", "--allow-empty", "-m", "one"], check=True)
    known = subprocess.run([*git, "rev-parse", "--short", "HEAD"], check=True, capture_output=True, text=True).stdout
    commit(results, known.strip())
    snapshot.write(results, docs(tmp_path))
    assert known.strip() in (tmp_path / "docs/results.md").read_text(encoding="utf-8")
    commit(results, "abcdef0")
    with pytest.raises(InputError, match="abcdef0, which this repository does not have"):
        snapshot.write(results, docs(tmp_path))


MODELS = pd.DataFrame({"model": ["a", "b", "b"], "error": [0.0137, 0.021, 0.043], "samples": [15, 15, 15]})


@pytest.fixture
def traced_docs(tmp_path):
    def write(*traced):
        entries = {"traced": traced, "given": [{"says": "Paper 1", "why": "a name"}]}
        (tmp_path / "readme.yaml").write_text(yaml.safe_dump(entries))
        MODELS.to_csv(tmp_path / "claims.csv", index=False)
        return tmp_path

    return write


def entry(says, take, of="100 * error", **more):
    return {"says": says, "table": "claims", "of": of, "take": take} | more


def test_numbers_are_looked_up_and_compared_as_written(traced_docs):
    folder = traced_docs(
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


def test_a_query_without_a_row_or_with_several_values_is_refused(traced_docs):
    folder = traced_docs(entry("of 1.4 %", ["only"], where="model == 'c'"))
    with pytest.raises(InputError, match="is found in no row of claims"):
        look_up(folder, folder)
    folder = traced_docs(entry("of 1.4 %", ["only"]))
    with pytest.raises(InputError, match="has 3 values; take min, median or max"):
        look_up(folder, folder)


def test_a_number_agrees_if_it_rounds_to_what_is_written():
    assert agrees("1.4", 1.35) and agrees("1.4", 1.4499) and not agrees("1.4", 1.46)
    assert agrees("298", 297.7) and not agrees("298", 297.4)
