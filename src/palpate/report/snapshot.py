"""Write docs/results.md, what a run found, from results/report.md, and trace README's numbers to it: ``make snapshot``.

The numbers of README.md are traced to the tables of a run by the queries in docs/readme.yaml.
"""

import os
import platform
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pandas as pd

from palpate.errors import InputError
from palpate.files import read_yaml, require_file, write_whole

QUERIES = "readme.yaml"
FOUND = "results/readme.csv"
"""The file of docs/ with the queries, and that with what they found in the run of docs/results.md."""
NUMBER = re.compile(r"\d+(?:\.\d+)?")
HEAD = """# Results of one run

`make snapshot` wrote this page from {source} on {cores} cores ({processor}, Python {python}). Times are those of this
machine; errors do not depend on it. `results/report.html` has all tables and figures, and says how to read them.
"""


def write(results: str | Path, docs: str | Path) -> None:
    """Write ``docs``/results.md and copy its pictures to ``docs``/results.

    Raises InputError if ``results`` lacks the report or a picture, or if its tables come from a commit that the
    repository around ``docs`` lacks.
    """
    results, docs = Path(results), Path(docs)
    text = require_file(results / "report.md").read_text(encoding="utf-8")
    timed = results / "tables/accuracy_vs_time.csv"
    commits = pd.read_csv(timed)["commit"].astype(str).unique() if timed.is_file() else []
    for commit in commits:
        _check_commit(commit, docs)
    pictures = [require_file(results / "figures" / name) for name in re.findall(r"\]\(figures/(.+?)\)", text)]
    shutil.rmtree(docs / "results", ignore_errors=True)
    (docs / "results").mkdir()
    for picture in pictures:
        shutil.copyfile(picture, docs / "results" / picture.name)
    if (docs / QUERIES).is_file():
        traced = look_up(docs, results / "tables")
        traced.to_csv(docs / FOUND, index=False)
    source = f"the tables of a run of commit {', '.join(commits)}" if len(commits) else "the tables of a run"
    machine = {"cores": os.cpu_count(), "processor": _processor(), "python": platform.python_version()}
    with write_whole(docs / "results.md") as part:
        head = HEAD.format(source=source, **machine)
        part.write_text(f"{head}\n{text.replace('](figures/', '](results/')}", encoding="utf-8")
    if (docs / QUERIES).is_file() and (lines := wrong(traced)):
        raise InputError(
            "docs/results.md is written; correct README.md and docs/readme.yaml: " + "; ".join(lines) + "."
        )


def _check_commit(commit: str, folder: Path) -> None:
    """Raise InputError unless ``commit`` is in the repository around ``folder``, if there is one."""
    git = ["git", "-C", str(folder)]
    try:
        if subprocess.run([*git, "rev-parse", "--git-dir"], capture_output=True).returncode:
            return
        there = subprocess.run([*git, "cat-file", "-e", f"{commit}^{{commit}}"], capture_output=True).returncode == 0
    except OSError:
        return
    if not there:
        raise InputError(
            f"The tables come from the code of {commit}, which this repository does not have; "
            "commit the code, run make, and then make snapshot."
        )


def _processor() -> str:
    """Return the name of the processor as the system gives it."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    named = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return named[0] if named else platform.machine()


def look_up(docs: Path, tables: Path) -> pd.DataFrame:
    """Return what a run found for each number that README says, with the rows that it comes from.

    docs : the folder of readme.yaml; tables : that of a run's tables; what it lacks is left out
    Raises InputError for a query that finds no row, or several values where there should be one.
    """
    rows = []
    for entry in traced(docs):
        file = tables / f"{entry['table']}.csv"
        if file.is_file():
            link = [entry["table"], entry.get("where", ""), entry["of"]]
            values = taken(entry, pd.read_csv(file))
            if values.empty and entry["take"] != ["count"]:
                raise InputError(
                    f"{QUERIES}: {entry['says']!r} is found in no row of {entry['table']}.csv; correct its query."
                )
            rows += [[entry["says"], *link, *each] for each in numbers(entry, values)]
    return pd.DataFrame(rows, columns=["says", *LINK, "take", "written", "found"])


LINK = ["table", "where", "of"]
"""What of an entry of readme.yaml says which rows, and what of them."""


def traced(docs: Path) -> list[dict[str, Any]]:
    """Return the entries of readme.yaml on numbers that a run finds."""
    return read_yaml(require_file(docs / QUERIES))["traced"]


def taken(entry: dict[str, Any], table: pd.DataFrame) -> pd.Series:
    """Return the values of the rows that an entry selects."""
    if "where" in entry:
        table = table.query(entry["where"], engine="python")
    if "once" in entry:
        table = table.drop_duplicates(entry["once"])
    return table[entry["of"]] if entry["of"] in table else table.eval(entry["of"], engine="python")


def numbers(entry: dict[str, Any], values: pd.Series) -> Iterator[tuple[str, str, float]]:
    """Yield what is taken of values, how README writes it, and the number; InputError if they do not fit."""
    written = NUMBER.findall(entry["says"])
    if len(written) != len(entry["take"]):
        raise InputError(f"{QUERIES}: {entry['says']!r} has {len(written)} numbers; take as many.")
    for take, text in zip(entry["take"], written, strict=True):
        if take == "only" and values.nunique() > 1:
            raise InputError(f"{QUERIES}: {entry['says']!r} has {values.nunique()} values; take min, median or max.")
        found = len(values) if take == "count" else values.iloc[0] if take == "only" else values.agg(take)
        yield take, text, float(found)


def agrees(written: str, found: float) -> bool:
    """Return whether a number rounds to what is written."""
    digits = len(written.partition(".")[2])
    return abs(found - float(written)) <= 0.5 * 10.0**-digits * (1.0 + 1e-9)


def wrong(rows: pd.DataFrame) -> list[str]:
    """Return a line for each number of ``look_up`` that README says otherwise."""
    return [
        f"README says {row.written} in {row.says!r}, and the run has {row.found:.4g}"
        for row in rows.itertuples()
        if not agrees(str(row.written), row.found)
    ]


def untraced(readme: str, docs: Path) -> list[str]:
    """Return the numbers in the prose of README that no entry of readme.yaml traces, each with the words around it."""
    text = " ".join(re.sub(r"```.*?```|`[^`]*`|\]\([^)]*\)", " ", readme, flags=re.DOTALL).split())
    entries = read_yaml(require_file(docs / QUERIES))
    for kind in ("traced", "given"):
        for entry in entries[kind]:
            text = text.replace(entry["says"], " ")
    return [text[max(found.start() - 30, 0) : found.end() + 10] for found in NUMBER.finditer(text)]


if __name__ == "__main__":
    write(*sys.argv[1:])
