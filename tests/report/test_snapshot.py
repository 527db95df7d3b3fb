"""The snapshot shows what a run's report shows and cites a commit that exists."""

import subprocess

import pandas as pd
import pytest

from palpate.errors import InputError
from palpate.report import snapshot


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
