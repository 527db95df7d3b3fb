"""Write docs/results.md, what a run found, from results/report.md: ``make snapshot``."""

import os
import platform
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pandas as pd

from palpate.errors import InputError
from palpate.files import require_file, write_whole

HEAD = """# Results of one run

`make snapshot` wrote this page from {source} on {cores} cores ({processor}, Python {python}). Times are those of this
machine; errors do not depend on it. `.full/results/report.html` has all tables and figures, and says how to read them.
"""


def write(results: str | Path, docs: str | Path) -> None:
    """Write ``docs``/results.md and copy its pictures to ``docs``/results.

    Raises InputError if ``results`` lacks the report or a picture, or if its tables come from a commit that the
    repository around ``docs`` lacks.
    """
    results, docs = Path(results), Path(docs)
    if not (results / "report.md").is_file():
        raise InputError(f"{results} has no report.md; type make full, and then make snapshot.")
    text = require_file(results / "report.md").read_text(encoding="utf-8")
    timed = results / "tables/accuracy_vs_time.csv"
    commits = pd.read_csv(timed, dtype={"commit": str})["commit"].unique() if timed.is_file() else []
    for commit in commits:
        _check_commit(commit, docs)
    pictures = [require_file(results / "figures" / name) for name in re.findall(r"\]\(figures/(.+?)\)", text)]
    shutil.rmtree(docs / "results", ignore_errors=True)
    (docs / "results").mkdir()
    for picture in pictures:
        shutil.copyfile(picture, docs / "results" / picture.name)
    source = (
        f"the tables of `make full` of commit {', '.join(commits)}" if len(commits) else "the tables of `make full`"
    )
    machine = {"cores": os.cpu_count(), "processor": _processor(), "python": platform.python_version()}
    with write_whole(docs / "results.md") as temporary:
        head = HEAD.format(source=source, **machine)
        temporary.write_text(f"{head}\n{text.replace('](figures/', '](results/')}", encoding="utf-8")


def _check_commit(commit: str, folder: Path) -> None:
    """Raise InputError if ``folder`` is in a Git repository that does not have ``commit``."""
    git = ["git", "-C", str(folder)]
    try:
        if subprocess.run([*git, "rev-parse", "--git-dir"], capture_output=True).returncode:
            return
        exists = subprocess.run([*git, "cat-file", "-e", f"{commit}^{{commit}}"], capture_output=True).returncode == 0
    except OSError:
        return
    if not exists:
        raise InputError(
            f"The tables come from the code of {commit}, which this repository does not have; "
            "commit the code, run make full, and then make snapshot."
        )


def _processor() -> str:
    """Return the name of the processor as the system gives it."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    named = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return named[0] if named else platform.machine()


if __name__ == "__main__":
    try:
        write(*sys.argv[1:])
    except InputError as error:
        sys.exit(f"error: {error}")
