"""Write docs/results.md, a page of Markdown with the main tables and figures of one run.

``python -m palpate.report.results_markdown results docs`` (``make snapshot``) writes it from the tables of a run.
"""

import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pandas as pd

from palpate.errors import InputError
from palpate.files import require_file, write_whole
from palpate.report import results_tables, tables
from palpate.studies.tradeoff.advice_words import agreement_words

TABLES = ["accuracy_vs_time", "advice", "truth", "dynamic_accuracy", "effects", "hard_cases", "scaling"]
SEVERAL = {
    "advice_agreement": (
        "How often splits agree",
        "The contacts are divided five times into those that train, choose and test. The model that most divisions "
        "advise, and how many do.",
    ),
    "advice_by_radius": (
        "Fingers of other radii",
        "What the first split advises for each radius, and its error; an arrow stands where it is another model than "
        "for the radius before.",
    ),
}
"""Tables that only some runs have, with their heading and what is said of them."""
STUDIES = {
    "law": (
        "The law of the tissue",
        "What another description of a body changes at the deepest press of each contact, beside the errors of meshes: "
        "least and most over the contacts, as a share of the peak. Where a truth is not believed, its own error says "
        "how well a change is known.",
    ),
    "measured": (
        "Models beside a measured body",
        "Errors of models whose modulus is fitted to one case, in the others: of how far the markers sink, and of the "
        "frequency of the swing after the release; repeats of the measurement differ as the last column says.",
    ),
    "palpation": (
        "Palpation",
        "How much stiffer places of a body are with its regions than without, under the largest force, by their "
        "distance from the region's elements.",
    ),
}
"""Tables of studies that a run may leave out, with their heading and what is said of them."""
PICTURES = ["advice", "truth", "dynamic_accuracy", "hard_cases", "scaling"]


def write(results: str | Path, docs: str | Path) -> None:
    """Write ``docs``/results.md and copy its pictures to ``docs``/results.

    Raises InputError for the first table or picture that ``results`` lacks, or if the tables come from a commit that
    the repository around ``docs`` lacks.
    """
    results, docs = Path(results), Path(docs)
    some = [name for name in (*SEVERAL, *STUDIES) if (results / "tables" / f"{name}.csv").is_file()]
    found = tables.read_all(results / "tables", [*TABLES, *some])
    commits = list(found["accuracy_vs_time"]["commit"].astype(str).unique())
    for commit in commits:
        _check_commit(commit, docs)
    scenes = _shown(found["accuracy_vs_time"])
    names = [*(f"work_precision_{scene}" for scene in scenes), *PICTURES]
    names += _more_pictures(found)
    pictures = [require_file(results / "figures" / f"{name}.png") for name in names]
    (docs / "results").mkdir(exist_ok=True)
    for picture in pictures:
        shutil.copyfile(picture, docs / "results" / picture.name)
    with write_whole(docs / "results.md") as part:
        part.write_text("\n\n".join(_page(found, scenes, commits)) + "\n", encoding="utf-8")


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


def _page(found: dict[str, pd.DataFrame], scenes: list[str], commits: list[str]) -> Iterator[str]:
    """Yield the paragraphs, tables and pictures of the page."""
    yield "# Results of one run"
    yield (
        f"`make snapshot` wrote this page from the tables of a run of commit {', '.join(commits)} on {os.cpu_count()} "
        f"cores ({_processor()}, Python {platform.python_version()}). Times are those of this machine; errors do not "
        "depend on it. What palpate has gained since that commit is not in it. `results/report.html` shows all tables "
        "and describes their columns; the [glossary](glossary.md) defines the words."
    )
    yield "## What to take"
    yield (
        "Errors are against the truth, as a share of the peak displacement: *rms* is the RMSE over the fine surface, "
        "*patch* the RMS error at the disc that is pressed. They are means over the test contacts of the first "
        "split; settings are chosen on other, validation contacts. Brackets hold the mean of all splits in 90 % of "
        "random draws of splits and contacts, and so need not hold that of the first split. *Splits* counts those that "
        "advise the same model, where there are several. In motion there is one load, and so no range."
    )
    yield _markdown(results_tables.advice(found["advice"]))
    yield _picture("advice")
    yield from _truth(found)
    yield "## Accuracy over time"
    for scene in scenes:
        yield f"### {scene.replace('_', ' ')}\n\n{_picture(f'work_precision_{scene}')}"
    yield "## In motion"
    yield (
        "Each model at the setting of its least error over all frames that are resolved, against FEM extrapolated to "
        "a step of zero, and its speed in multiples of real time. Springs and shape matching are fitted to another "
        "motion of the same body: at another place and on another course, or under half of the loads."
    )
    yield _markdown(results_tables.motion(found["dynamic_accuracy"]))
    yield _picture("dynamic_accuracy")
    yield from _studies(found)
    yield "## Scenes and their effects"
    yield (
        "The time of a step, and for each effect the error of the scene without it (RMSE / peak). Effects that hold "
        "the body together or in place are left out."
    )
    yield _markdown(results_tables.effects(found["effects"]))
    yield "## Hard cases"
    yield _markdown(results_tables.hard_cases(found["hard_cases"]))
    yield _picture("hard_cases")
    yield f"## Scaling\n\n{_picture('scaling')}"
    yield _markdown(results_tables.scaling(found["scaling"]))


def _truth(found: dict[str, pd.DataFrame]) -> Iterator[str]:
    """Yield how well the truth is known and, of a run that has it, how far advice depends on splits and fingers."""
    yield "## How well the truth is known"
    yield (
        "The truth is the limit of quadratic elements on nested meshes (Richardson's extrapolation); its own error is "
        "in the units and on the nodes of the models' errors, and below it models are tied. *Inverted* counts samples "
        "with an inverted element, *elements* those of the finest mesh."
    )
    yield _markdown(results_tables.truth(found["truth"]))
    yield _picture("truth")
    for name, (heading, said) in SEVERAL.items():
        if name in found:
            yield f"## {heading}"
            yield f"{said} {agreement_words(found[name])}" if name == "advice_agreement" else said
            yield _markdown(getattr(results_tables, name.removeprefix("advice_"))(found[name]))


def _studies(found: dict[str, pd.DataFrame]) -> Iterator[str]:
    """Yield what the studies of tissue found, those that were asked for."""
    for name, (heading, said) in STUDIES.items():
        if name in found:
            yield f"## {heading}"
            yield said
            yield _markdown(getattr(results_tables, name)(found[name]))
            yield from (_picture(picture) for picture in _more_pictures({name: found[name]}))


def _more_pictures(found: dict[str, pd.DataFrame]) -> list[str]:
    """Return the names of the pictures of the studies of tissue: of what was measured one for each experiment."""
    experiments = found["measured"]["experiment"].unique() if "measured" in found else []
    return [
        *(["law"] if "law" in found else []),
        *(f"measured_{experiment}" for experiment in experiments),
        *(["palpation"] if "palpation" in found else []),
    ]


def _shown(settings: pd.DataFrame) -> list[str]:
    """Return the scenes whose diagrams are shown: those with the most splits, as a page of all would be long."""
    splits = settings.groupby("scene")["split"].nunique()
    return [scene for scene in tables.scenes(settings) if splits[scene] == splits.max()]


def _markdown(table: pd.DataFrame) -> str:
    lines = [table.columns, ["---"] * len(table.columns), *table.astype(str).to_numpy()]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _picture(name: str) -> str:
    return f"![{name.replace('_', ' ')}](results/{name}.png)"


def _processor() -> str:
    """Return the name of the processor as the system gives it."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    named = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return named[0] if named else platform.machine()


if __name__ == "__main__":
    write(*sys.argv[1:])
