"""Describe what a run will cost before it begins: jobs, minutes, memory, and what to change if that is much."""

from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

from palpate.plan.jobs import is_parallel
from palpate.plan.memory import available_mb, memory_mb
from palpate.plan.others import Others
from palpate.plan.schedule import follow
from palpate.plan.sizes import size_of
from palpate.plan.timings import Timings
from palpate.plan.work import Case, Job, amounts, kind_of

LONG_MIN = 30.0
"""Minutes from which on a run is warned of."""
FEW_JOBS = 30
"""Jobs that call all functions; fewer call, and compile, a part of them."""
SLOWED = 1.25
"""How many times as long a run takes, from which on that is said."""
SHORT_MIN = 0.5
"""Minutes of a run below which it is not."""


def case_of(config: dict, jobs: Sequence[Job], folder: Path, results: Path = Path("results")) -> Case:
    """Return settings with the sizes of their bodies, read where a body is made and need not be made again.

    folder : of the config file, which paths are relative to
    """
    anew = {job.wildcards["body"] for job in jobs if job.rule == "make_body"}
    used = {job.wildcards[key] for job in jobs for key in ("body",) if key in job.wildcards}
    used |= {name for name in config["bodies"] if any("scene" in job.wildcards for job in jobs)}
    sizes = {
        name: size_of(entry, folder, None if name in anew else results / "data" / name / "body.h5")
        for name, entry in config["bodies"].items()
        if name in used
    }
    return Case(config, sizes)


def describe(
    jobs: Sequence[Job],
    case: Case,
    timings: Timings,
    cores: int | None,
    first: bool = False,
    others: Others | None = None,
) -> list[str]:
    """Return lines that say what ``jobs`` will cost on this machine, the warnings last.

    cores : of this machine, or None where jobs run on others, as on a cluster
    first : whether functions have to be compiled, as in the first run after an installation or a change of the code
    others : other programs on this machine
    """
    if not jobs:
        return ["nothing to do: everything that was asked for is up to date"]
    count = f"{len(jobs)} job{'s' if len(jobs) > 1 else ''} to do"
    if cores is None:
        alone = sum(estimates(jobs, case, timings)) / 60
        return [f"{count}: about {_minutes(alone)} of one core of this machine; the cluster's may be faster or slower"]
    seconds, memory = estimates(jobs, case, timings, first), [memory_mb(job, case) for job in jobs]
    on_cores = on_threads(jobs, case, seconds, cores)
    course = follow(jobs, on_cores, memory, cores)
    minutes, left = course.seconds / 60, available_mb()
    on = f"{cores} core{'s' if cores > 1 else ''} of this machine"
    lines = [f"{count}: about {_minutes(minutes)} on {on}, up to {course.memory_mb / 1e3:.1f} GB of memory"]
    if others and minutes > SHORT_MIN:
        lines += _beside(others, minutes, sum(on_cores) / course.seconds)
    if minutes > LONG_MIN:
        lines.append(f"warning: {_what_takes_most(jobs, seconds, case, minutes)}")
    if course.memory_mb > left:
        lines.append(
            f"warning: that is more than the {left / 1e3:.1f} GB of memory that are free, so a job may be ended; "
            f"{_remedies(_heaviest(jobs, memory), case)}, or run fewer jobs at a time (cores in the profile)."
        )
    return lines


def _beside(others: Others, minutes: float, used: float) -> list[str]:
    """Return a line on what ``minutes`` become beside other programs if that is much more; used : processors, alone."""
    if not (slow := others.slow(used)) > SLOWED:
        return []
    slowed, there = _minutes(minutes * slow), others.processors
    return [f"other programs have work for {others.use:.1f} processors of {there}; beside them it takes about {slowed}"]


def estimates(jobs: Sequence[Job], case: Case, timings: Timings, first: bool = False) -> list[float]:
    """Estimate what each job takes [s], its start included; with ``first`` compiling functions, shared among all."""
    start = timings.shipped_seconds("start", {})
    compiling = timings.shipped_seconds("compile", {}) / max(len(jobs), FEW_JOBS) if first else 0.0
    return [start + compiling + timings.seconds(kind_of(job, case), amounts(job, case)) for job in jobs]


def on_threads(jobs: Sequence[Job], case: Case, seconds: Sequence[float], cores: int) -> list[float]:
    """Divide the ``seconds`` of jobs that use all of their threads among these."""
    threads = [min(job.threads, cores) if is_parallel(kind_of(job, case)) else 1 for job in jobs]
    return [taken / count for taken, count in zip(seconds, threads, strict=True)]


def _minutes(minutes: float) -> str:
    if minutes < 1.5:
        return "a minute"
    if minutes < 90.0:
        return f"{minutes:.1f} minutes" if minutes < 5.0 else f"{minutes:.0f} minutes"
    return f"{minutes / 60:.1f} hours"


def _what_takes_most(jobs: Sequence[Job], seconds: Sequence[float], case: Case, minutes: float) -> str:
    """Name the body or the rule that takes most, its share, and the settings that lower it."""
    shares: dict[str, float] = defaultdict(float)
    for job, taken in zip(jobs, seconds, strict=True):
        shares[_owner(job)] += taken
    most = max(shares, key=lambda owner: shares[owner])
    return (
        f"{_minutes(minutes)} is long, and {shares[most] / sum(shares.values()):.0%} of it is {most}; "
        f"{_remedies(most, case)}, or let it run."
    )


def _owner(job: Job) -> str:
    """Return what a job belongs to as the settings name it: a body, a scene, or else its rule."""
    for key in ("body", "scene"):
        if key in job.wildcards:
            return {"body": "bodies", "scene": "scenes"}[key] + f".{job.wildcards[key]}"
    return f"the rule {job.rule}"


def _heaviest(jobs: Sequence[Job], memory: Sequence[float]) -> str:
    return _owner(max(zip(memory, jobs, strict=True), key=lambda pair: pair[0])[1])


def _remedies(owner: str, case: Case) -> str:
    """Name the settings that make less of the work of ``owner``."""
    group, _, name = owner.partition(".")
    if group == "scenes":
        return f"lower duration_s or level of {owner}"
    if group != "bodies":
        return "lower the settings of its study"
    entry = case.config["bodies"][name]
    keys = ["refinements"] if entry.get("refinements", 0) > 1 else []
    keys += ["surface_nodes"] if "surface_nodes" in entry else []
    keys += ["train and test"] if "train" in entry else []
    lower = f"lower {' or '.join(keys) or 'the size'} of {owner}"
    return f"{lower} or tradeoff.contacts" if "tradeoff" in case.config else lower
