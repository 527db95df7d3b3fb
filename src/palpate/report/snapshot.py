"""What one run found, as a page of Markdown with its pictures: docs/results.md.

``python -m palpate.report.snapshot results docs`` (``make snapshot``) writes it from the tables of a finished run.
"""

import os
import platform
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd

from palpate.evaluation.tradeoff.advice import NONE
from palpate.evaluation.tradeoff.advice_reasons import behind
from palpate.evaluation.tradeoff.equal_settings import CLOSE, EQUAL
from palpate.figures import tables
from palpate.figures.model_looks import label
from palpate.figures.number_format import percent, seconds
from palpate.files import made, write_whole
from palpate.report.advice_words import interval, limit

PICTURES = ["advice", "dynamic_accuracy", "hard_cases", "scaling"]


def write(results: str | Path, docs: str | Path) -> None:
    """Write ``docs``/results.md and copy its pictures to ``docs``/results.

    Raises InputError naming the first table or picture that ``results`` lacks.
    """
    results, docs = Path(results), Path(docs)
    found = tables.read_all(results / "tables", ["accuracy_vs_time", "advice", "hard_cases", "scaling"])
    scenes = tables.scenes(found["accuracy_vs_time"])
    names = [*(f"work_precision_{scene}" for scene in scenes), *PICTURES]
    pictures = [made(results / "figures" / f"{name}.png") for name in names]
    (docs / "results").mkdir(exist_ok=True)
    for picture in pictures:
        shutil.copyfile(picture, docs / "results" / picture.name)
    with write_whole(docs / "results.md") as part:
        part.write_text("\n\n".join(_page(found, scenes)) + "\n", encoding="utf-8")


def _page(found: dict[str, pd.DataFrame], scenes: list[str]) -> Iterator[str]:
    settings, advice = found["accuracy_vs_time"], found["advice"]
    commits = ", ".join(settings["commit"].astype(str).unique())
    yield "# What one run found"
    yield (
        f"Written by `make snapshot` from the tables of a run of {commits} on {os.cpu_count()} cores "
        f"({_processor()}, Python {platform.python_version()}). Times are this machine's; errors are not. "
        "`results/report.html` has all of it, with what every column means."
    )
    yield "## What to take"
    yield _markdown(_advice(advice))
    yield _picture("advice")
    yield "## What accuracy costs"
    for scene in scenes:
        yield f"### {scene.replace('_', ' ')}\n\n{_picture(f'work_precision_{scene}')}"
    yield f"## In motion\n\n{_picture('dynamic_accuracy')}"
    yield "## Hard cases"
    yield _markdown(pd.crosstab(found["hard_cases"]["family"], found["hard_cases"]["outcome"]).reset_index())
    yield _picture("hard_cases")
    yield f"## How far it scales\n\n{_picture('scaling')}"
    every = tables.where(found["scaling"], component="fem")
    fem, most = tables.where(every, stage="respond"), every.groupby("size")["memory_mb"].max()
    fem = fem.assign(
        seconds=fem["seconds"].map(seconds), memory=[f"{1e-3 * most[size]:.2g} GB" for size in fem["size"]]
    ).rename(columns={"size": "tetrahedra", "seconds": "a press"})
    yield _markdown(fem[["tetrahedra", "a press", "memory"]])


def _advice(advice: pd.DataFrame) -> pd.DataFrame:
    rows = []
    for _, row in advice.iterrows():
        if row["model"] == NONE:
            rows.append([row["scene"], limit(row), NONE, "", "", ""])
            continue
        rival = _behind(row) if row["factor"] > 0 else ""
        error = f"{percent(row['rmse_of_peak'])} ({interval(row)})"
        rows.append(
            [row["scene"], limit(row), label(row["model"], row["setting"]), error, seconds(row["online_p95_s"]), rival]
        )
    return pd.DataFrame(rows, columns=["scene", "asked", "take", "error", "95th percentile of time", "next best"])


def _behind(row: pd.Series) -> str:
    far = behind(row["factor"], *((EQUAL, "wrong") if np.isfinite(row["budget_ms"]) else (CLOSE, "slow")))
    return f"{label(row['rival'], 'default')}, {far}"


def _markdown(table: pd.DataFrame) -> str:
    lines = [table.columns, ["---"] * len(table.columns), *table.astype(str).to_numpy()]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _picture(name: str) -> str:
    return f"![{name.replace('_', ' ')}](results/{name}.png)"


def _processor() -> str:
    """The processor as the system names it."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    named = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return named[0] if named else platform.machine()


if __name__ == "__main__":
    write(*sys.argv[1:])
