"""What a run will cost: right within a factor of 1.5 for runs that were recorded, and said in a line."""

import json
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from palpate.files import read_yaml
from palpate.plan import describe as describing
from palpate.plan.describe import case_of, describe, estimates, on_threads
from palpate.plan.others import LOOK_S, Others, look, own_seconds
from palpate.plan.schedule import follow
from palpate.plan.sizes import Level, Size
from palpate.plan.timings import SHIPPED, Timings
from palpate.plan.work import Case, Job, amounts, kind_of
from palpate.plan.work_of_studies import MOST_NODES
from palpate.run.settings import complete, defaults

ROOT = Path(__file__).parents[2]
RECORDED = Path(__file__).parent / "recorded"
GONE = {"image": None, "mask": None, "path": __file__}
"""Files of bodies that are not here now, and what stands in their place."""
NEW = Timings(read_yaml(SHIPPED), {})


def recorded(name: str) -> tuple[list[Job], Case, list[float], dict]:
    """Return the jobs of a run, its settings and sizes, what each job took [s], and the rest of its file."""
    told = json.loads((RECORDED / f"{name}.json").read_text())
    settings = told["settings"] if isinstance(told["settings"], dict) else read_yaml(ROOT / told["settings"])
    for body in settings["bodies"].values():
        body.update(
            {key: None for key in ("image", "mask") if key in body} | ({"path": __file__} if "path" in body else {})
        )
    settings.get("tradeoff", {}).pop("own_models", None)
    jobs = [Job(rule, wild, threads=threads, after=tuple(after)) for rule, wild, threads, after, _ in told["jobs"]]
    sizes = {
        body: Size(tuple(Level(*level) for level in levels), contacts)
        for body, (levels, contacts) in told["sizes"].items()
    }
    file = ROOT / ("config.yaml" if isinstance(told["settings"], dict) else told["settings"])
    case = Case(complete(settings, file), sizes)
    return jobs, case, [row[-1] for row in told["jobs"]], told


@pytest.mark.parametrize("name", ["default", "smoke"])
def test_a_recorded_run_took_what_is_estimated_within_half_as_much_again(name):
    jobs, case, _, told = recorded(name)
    found = estimates(jobs, case, NEW)
    alone = on_threads(jobs, case, found, told["cores"])
    course = follow(jobs, alone, [0.0] * len(jobs), told["cores"])
    assert told["took_s"] / 1.5 < course.seconds < 1.5 * told["took_s"]


def learnt_from(name: str, slower: float) -> Timings:
    """Return what a machine that is so many times as slow knows after one recorded run."""
    jobs, case, took, _ = recorded(name)
    here: dict[str, list[list[float]]] = {}
    for job, seconds in zip(jobs, took, strict=True):
        kind = kind_of(job, case)
        here.setdefault(kind, []).append([NEW.shipped_seconds(kind, amounts(job, case)), slower * seconds])
    return Timings(read_yaml(SHIPPED), here)


@pytest.mark.parametrize("name", ["default", "smoke"])
def test_a_machine_half_as_fast_is_found_out_by_one_small_run(name):
    jobs, case, took, _ = recorded(name)
    truth = sum(2.0 * seconds for seconds in took) + len(jobs) * NEW.shipped_seconds("start", {})
    assert sum(estimates(jobs, case, NEW)) < truth / 1.4
    assert truth / 1.5 < sum(estimates(jobs, case, learnt_from("smoke", 2.0))) < truth * 1.5


def test_the_estimate_of_a_second_run_is_closer_still():
    jobs, case, took, _ = recorded("default")
    truth = sum(took) + len(jobs) * NEW.shipped_seconds("start", {})
    new, again = (sum(estimates(jobs, case, known)) for known in (NEW, learnt_from("default", 1.0)))
    assert abs(again / truth - 1) < 0.08 and abs(again / truth - 1) < abs(new / truth - 1)


def test_a_run_is_described_in_a_line():
    jobs, case, _, _ = recorded("smoke")
    [line] = describe(jobs, case, NEW, 2)
    assert re.fullmatch(
        r"169 jobs to do: about (a minute|\d\.\d minutes) on 2 cores of this machine, up to \d\.\d GB of memory", line
    )
    assert describe([], case, NEW, 2) == ["nothing to do: everything that was asked for is up to date"]
    assert "1 job to do: about a minute on 1 core of" in describe([Job("write_report")], case, NEW, 1)[0]


def test_on_a_cluster_only_processor_time_is_said():
    jobs, case, _, _ = recorded("smoke")
    [line] = describe(jobs, case, NEW, None)
    assert re.match(r"169 jobs to do: about \d\.\d minutes of one core of this machine; the cluster's may be", line)


def test_more_cores_take_less_time_and_compiling_takes_more():
    jobs, case, _, _ = recorded("default")
    minutes = [
        float(re.search(r"about ([\d.]+) minutes", describe(jobs, case, NEW, cores)[0])[1]) for cores in (1, 2, 8)
    ]
    assert minutes[0] > 1.8 * minutes[1] and minutes[1] > 1.4 * minutes[2]
    assert sum(estimates(jobs, case, NEW, first=True)) - sum(estimates(jobs, case, NEW)) == pytest.approx(40, rel=0.01)


def test_a_portable_model_costs_what_its_level_does_not_the_fine_mesh():
    """For palpate try, 32 contacts of SOFA's liver took 57 to 86 s of a core on a mesh that is refined once."""
    assert defaults("tradeoff")["settings"]["contact_modes"]["nodes"] == MOST_NODES
    jobs, case, took, _ = recorded("default")
    [(job, shipped)] = [(job, took[i]) for i, job in enumerate(jobs) if job.rule == "export_model"]
    [seconds] = estimates([job], case, NEW)
    assert shipped / 1.5 < seconds < 1.5 * shipped
    once = Case(
        case.config | {"press": case.config["press"] | {"contacts": 32}},
        {"liver": replace(case.sizes["liver"], levels=case.sizes["liver"].levels[:2])},
    )
    [tried] = estimates([job], once, NEW)
    assert 50 < tried < 86 and tried > seconds


@pytest.mark.parametrize(("use", "processors", "said"), [(0.1, 2, None), (20.0, 64, None), (1.5, 2, "1.5")])
def test_other_programs_slow_a_run_only_where_there_are_too_few_processors(use, processors, said):
    jobs, case, _, _ = recorded("default")
    first, *rest = describe(jobs, case, NEW, 2, others=Others(use, processors))
    assert first == describe(jobs, case, NEW, 2)[0]
    slowed = [line for line in rest if line.startswith("other programs")]
    assert len(slowed) == (said is not None)
    if said:
        alone, beside = (float(re.search(r"([\d.]+) minutes", line)[1]) for line in (first, slowed[0]))
        assert f"have work for {said} processors of 2; beside them it takes about" in slowed[0]
        assert beside == pytest.approx(1.75 * alone, abs=1.0)
    [short] = describe([Job("write_report")], case, NEW, 2, others=Others(use, processors))
    assert "about a minute" in short


@pytest.mark.parametrize(
    ("percent", "own", "use", "slow"),
    [
        (75.0, 0.0, 3.0, 1.25),
        (10.0, 0.0, 0.4, 1.0),
        (100.0, 0.0, 8.0, 2.5),
        (75.0, 2.0, 1.0, 1.0),
        (10.0, 1.0, 0.0, 1.0),
    ],
)
def test_programs_count_that_wait_for_full_processors_and_a_runs_own_do_not(monkeypatch, percent, own, use, slow):
    """The load of a minute ago counts only where the machine is still full."""
    used = iter([5.0, 5.0 + own * LOOK_S])
    monkeypatch.setattr("palpate.plan.others.own_seconds", lambda: next(used))
    monkeypatch.setattr("psutil.cpu_percent", lambda seconds: percent)
    monkeypatch.setattr("psutil.cpu_count", lambda: 4)
    monkeypatch.setattr("psutil.getloadavg", lambda: (8.0, 1.0, 1.0))
    found = look()
    assert found == Others(pytest.approx(use), 4) and found.slow(2) == slow


def test_what_a_process_has_started_is_its_own():
    """As the job server is, which imports libraries while the plan is made."""
    spin = "import time\nwhile time.process_time() < 0.3: pass\nprint(flush=True), input()"
    before = own_seconds()
    with subprocess.Popen([sys.executable, "-c", spin], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as started:
        started.stdout.readline()
        assert own_seconds() - before > 0.25
        started.communicate(b"\n")


@pytest.fixture
def kidney():
    """The jobs of an organ as found: a surface of 18000 nodes, refined twice."""
    jobs, case, _, _ = recorded("smoke")
    own = [replace(job, wildcards=job.wildcards | {"body": "own"}) for job in jobs if "body" in job.wildcards]
    own = [replace(job, after=()) for job in own if job.wildcards.get("regime") != "point_small"]
    own = [job for job in own if job.rule in ("choose_presses", "simulate_fine", "simulate_truth", "measure_models")]
    config = case.config | {"bodies": {"own": {"kind": "ct", "surface_nodes": 6570, "refinements": 2}}}
    coarse = Level(60000, 18000, 288000)
    return own, Case(config, {"own": Size((coarse, coarse.refined(), coarse.refined().refined()), 3183)})


def test_hours_are_warned_of_with_what_to_change(kidney, monkeypatch):
    monkeypatch.setattr(describing, "available_mb", lambda: 1e9)
    cost, warning = describe(*kidney, NEW, 2)
    assert re.search(r"about \d+\.\d hours on 2 cores", cost)
    assert re.fullmatch(
        r"warning: \d+\.\d hours is long, and 100% of it is bodies\.own; lower refinements or surface_nodes of "
        r"bodies\.own or tradeoff\.contacts, or let it run\.",
        warning,
    )


def test_fewer_contacts_and_refinements_make_hours_less(kidney):
    jobs, case = kidney
    most = sum(estimates(jobs, case, NEW))
    few = Case(case.config | {"tradeoff": case.config["tradeoff"] | {"contacts": 5}}, case.sizes)
    assert sum(estimates(jobs, few, NEW)) < 0.95 * most
    coarser = Case(case.config, {"own": replace(case.sizes["own"], levels=case.sizes["own"].levels[:2])})
    assert sum(estimates(jobs, coarser, NEW)) < 0.3 * most


def test_more_memory_than_there_is_is_warned_of(kidney, monkeypatch):
    monkeypatch.setattr(describing, "available_mb", lambda: 8000.0)
    *_, warning = describe(*kidney, NEW, 2)
    assert warning.startswith("warning: that is more than the 8.0 GB of memory that are free, so a job may be ended")
    assert "lower refinements or surface_nodes of bodies.own" in warning
    assert len(describe(*recorded("smoke")[:2], NEW, 2)) == 1


def test_sizes_of_bodies_that_need_not_be_made_are_read(slab, tmp_path):
    from palpate.bodies.body_file import save

    config = {"bodies": {"slab": {"kind": "ct", "surface_nodes": 900, "refinements": 1}}}
    save(slab, tmp_path / "data/slab/body.h5")
    use, make = Job("compute_compliance", {"body": "slab"}), Job("make_body", {"body": "slab"})
    assert case_of(config, [use], Path(), tmp_path).sizes["slab"].coarse.elements == len(slab.coarse.tetrahedra)
    assert case_of(config, [make, use], Path(), tmp_path).sizes["slab"].coarse.surface == 900
