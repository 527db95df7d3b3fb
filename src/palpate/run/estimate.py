"""What a run will cost: jobs, minutes and memory, before it begins and while it goes on.

A job takes as long as it took last time in this folder; one that has not run here, what its rule took when config.yaml
was recorded, scaled by the size of its body, the number of presses and the speed of this machine. Jobs that have ended
since correct that for those to come: by how much they were slower.
"""

import csv
import re
import time
from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from palpate.run.job import kernel_cache

RECORDED = Path(__file__).with_name("timings.csv")
"""By rule, and where that matters by ``of``, a wildcard: seconds of a core and megabytes of a job of config.yaml; on
two cores of a cloud machine (AMD EPYC, November 2026).

tetrahedra : of the body; memory grows in proportion, times with the power ``growth``: near 1 where the finest elements
are solved, as the cylinder and the liver of config.yaml show, and 0 of most models
presses : of which a job is; the share OF_PRESSES of its time is proportional to their number
"""
OF_PRESSES = 0.5
"""Share of a time that is proportional to the presses: preparation and the settings that are timed are the same."""
TOOK = re.compile(r"^took ([\d.]+) s, ([\d.]+) s of a core$", re.MULTILINE)
"""The last line of a job's log, which ``palpate.run.job`` writes."""
UNKNOWN = (5.0, 250.0)
"""Seconds and megabytes of a job about which nothing is known, such as that of a model of the user's own."""
START_S = 0.3
COMPILE_S = 80.0
"""What all functions take to be compiled, in a first run."""
FIRST_MB = 250.0
"""Memory that does not grow with the body."""
LONG_MIN = 30.0
"""Minutes from which on a run is warned of."""
SURE_S = 60.0
"""Estimated seconds of jobs that have ended from which on their pace counts for more than the estimate."""
SPEED_TEST = ("speed_test", "")
"""The row of RECORDED that says what ``speed_test`` took on its machine."""
IN_PARALLEL = ("fit_springs",)
"""Rules whose jobs use all of their threads; others use one and hold the rest, so that their times are undisturbed."""


class Job(NamedTuple):
    """A job that has to run."""

    rule: str
    wildcards: Mapping[str, str]
    threads: int
    log: str


def jobs_of(dag: Any) -> tuple[list[Job], list[Job]]:
    """Return the jobs of snakemake's ``dag`` that do something: those that have to run, and those up to date.

    Snakemake tells its loggers only how many jobs each rule has, and a body or a model makes much of a difference.
    """
    todo = set(dag.needrun_jobs())
    jobs: tuple[list[Job], list[Job]] = [], []
    for job in dag.jobs:
        if job.rule.script:
            log = str(job.log[0]) if job.log else ""
            jobs[job not in todo].append(Job(job.rule.name, dict(job.wildcards.items()), job.threads, log))
    return jobs


def sizes(bodies: Mapping[str, Mapping], folder: str | Path) -> dict[str, float]:
    """Return the number of tetrahedra of the finest mesh of each body.

    bodies : the settings of each; folder : with <body>/body.h5 of those that are made already, which are counted
    """
    return {
        name: _counted(Path(folder) / name / "body.h5") or _expected(entry) * 8.0 ** entry.get("refinements", 1)
        for name, entry in bodies.items()
    }


def _counted(file: Path) -> int:
    """Return the number of elements of the finest mesh in a body's file, or 0 if there is no such file."""
    import h5py

    with suppress(OSError, KeyError), h5py.File(file) as body:
        finest = body[f"level_{body.attrs['levels'] - 1}"]
        return len(finest["triangles" if "triangles" in finest else "tetrahedra"])
    return 0


def _expected(entry: Mapping) -> float:
    """Return about how many elements the coarse mesh of a body has: 0.38 n^1.5 inside of a surface of n nodes."""
    if divisions := entry.get("divisions"):
        return (2.0 if len(divisions) == 2 else 6.0) * float(np.prod(divisions))
    return 0.38 * float(entry.get("surface_nodes") or (182 if entry.get("kind") == "cylinder" else 140)) ** 1.5


def recorded(job: Job, tetrahedra: Mapping[str, float], presses: int | None = None) -> tuple[float, float]:
    """Return what a job like this takes [s] and needs [MB] by what was recorded when config.yaml ran.

    tetrahedra : of each body (``sizes``); presses : of each body and regime, or None for as many as were recorded
    """
    rule = next((name for name in ("draw", "merge") if job.rule.startswith(f"{name}_") and not job.wildcards), job.rule)
    table = _table()
    row = next((row for of in (*job.wildcards.values(), "") if (row := table.get((rule, of)))), None)
    if row is None:
        return UNKNOWN
    seconds, mb = row["seconds"], row["mb"]
    if row["tetrahedra"] and (size := tetrahedra.get(job.wildcards.get("body", ""))):
        larger = size / row["tetrahedra"]
        seconds, mb = seconds * larger ** row["growth"], FIRST_MB + (mb - FIRST_MB) * larger
    if row["presses"] and presses:
        seconds *= 1.0 - OF_PRESSES + OF_PRESSES * presses / row["presses"]
    return seconds, mb


def _table() -> dict[tuple[str, str], dict[str, float]]:
    """Return the numbers of each rule and wildcard in RECORDED, by their columns; 0 where a cell is empty."""
    numbers = ("seconds", "mb", "tetrahedra", "growth", "presses")
    with RECORDED.open(encoding="utf-8") as file:
        return {
            (row["rule"], row["of"]): {name: float(row[name] or 0) for name in numbers} for row in csv.DictReader(file)
        }


class Estimate:
    """What jobs will cost on this machine.

    tetrahedra, presses : as ``recorded`` takes them
    cores : of this machine, or None where jobs run on others, as on a cluster
    ended : other jobs of the run, which are up to date and tell the pace
    """

    def __init__(
        self,
        jobs: Sequence[Job],
        tetrahedra: Mapping[str, float],
        cores: int | None,
        presses: int | None = None,
        ended: Sequence[Job] = (),
    ):
        self._jobs, self._cores = jobs, cores
        self._first = not kernel_cache().is_dir()
        self._recorded = [recorded(job, tetrahedra, presses) for job in jobs]
        before = [last_seconds(job) for job in jobs]
        pace = slowness() * _pace(
            [
                (took, START_S + recorded(job, tetrahedra, presses)[0] * slowness())
                for job in ended
                if (took := last_seconds(job)) is not None
            ]
        )
        self._seconds = [
            START_S + (cost[0] * pace if took is None else took)
            for took, cost in zip(before, self._recorded, strict=True)
        ]
        self._at = {job.log: i for i, job in enumerate(jobs)}

    def minutes(self) -> float:
        """Return how long the run takes [min], or how long one core of this machine would."""
        return self._minutes(self._seconds) + (COMPILE_S / 60 / (self._cores or 1) if self._first else 0.0)

    def minutes_left(self, ended: Collection[str], running: Mapping[str, float]) -> float:
        """Return how long the rest of a run takes [min], at the pace of the jobs that have ended.

        ended : their logs; running : for how long [s] others have run, by their logs
        """
        done = [self._at[log] for log in ended if log in self._at]
        times = {i: took for i in done if (took := _took(self._jobs[i])) is not None}
        pace = _pace([(clock, self._seconds[i]) for i, (clock, _) in times.items()])
        left = [seconds * pace for seconds in self._seconds]
        for i in done:
            left[i] = 0.0
        for log, seconds in running.items():
            if log in self._at:
                left[self._at[log]] = max(left[self._at[log]] - seconds, 0.0)
        return self._minutes(left)

    def _minutes(self, seconds: Sequence[float]) -> float:
        """Return how long jobs take [min] that take these ``seconds`` each."""
        held = [
            each * (1 if job.rule in IN_PARALLEL else min(job.threads, self._cores or 1))
            for job, each in zip(self._jobs, seconds, strict=True)
        ]
        return max(sum(held) / (self._cores or 1), max(seconds, default=0.0)) / 60

    def memory_mb(self) -> float:
        """Return the most memory that jobs need which may run at one time."""
        return sum(sorted((mb for _, mb in self._recorded), reverse=True)[: self._cores or 1])

    def describe(self) -> list[str]:
        """Return lines that say what the run will cost, the warnings last."""
        if not self._jobs:
            return ["nothing to do: everything that was asked for is up to date"]
        count, minutes = f"{len(self._jobs)} job{'s' if len(self._jobs) > 1 else ''} to do", self.minutes()
        if self._cores is None:
            return [f"{count}: about {words(minutes)} of one core of this machine"]
        on = f"{self._cores} core{'s' if self._cores > 1 else ''} of this machine"
        memory, free = self.memory_mb(), free_mb()
        lines = [f"{count}: about {words(minutes)} on {on}, up to {memory / 1e3:.1f} GB of memory"]
        if minutes > LONG_MIN:
            most, share = self._most()
            lines.append(
                f"warning: {share:.0%} of these {words(minutes)} are of {most}; lower its settings, or let it run."
            )
        if memory > free:
            lines.append(
                f"warning: that is more than the {free / 1e3:.1f} GB of memory that are free, so a job may be ended; "
                "lower refinements of the bodies, or run fewer jobs at a time (cores in the profile)."
            )
        return lines

    def _most(self) -> tuple[str, float]:
        """Return the body, or else the rule, that takes most, and its share."""
        shares: dict[str, float] = defaultdict(float)
        for job, seconds in zip(self._jobs, self._seconds, strict=True):
            body = job.wildcards.get("body")
            shares[f"bodies.{body}" if body else f"the rule {job.rule}"] += seconds
        return max(shares, key=lambda name: shares[name]), max(shares.values()) / sum(shares.values())


def _pace(pairs: Sequence[tuple[float, float]]) -> float:
    """Return how many times as long jobs took as was estimated, from pairs of both [s]; near 1 where these are few."""
    return (SURE_S + sum(took for took, _ in pairs)) / (SURE_S + sum(estimated for _, estimated in pairs))


def last_seconds(job: Job) -> float | None:
    """Return what a job took last time [s] on a machine with nothing else to do, or None if its log does not say."""
    if (took := _took(job)) is None:
        return None
    clock, core = took
    return core if job.rule in IN_PARALLEL else min(clock, core)


def _took(job: Job) -> tuple[float, float] | None:
    """Return what a job took by the clock, others beside it, and of a core [s], or None if its log does not say."""
    with suppress(OSError):
        if lines := TOOK.findall(Path(job.log).read_text(encoding="utf-8")):
            clock, core = map(float, lines[-1])
            return clock, core
    return None


@cache
def slowness() -> float:
    """Return how many times as long this machine takes as that of RECORDED."""
    return speed_test() / _table()[SPEED_TEST]["seconds"]


def speed_test() -> float:
    """Return the shortest of five times of a core [s] for work like that of jobs: interpreted, compiled, in memory.

    Trap: np.sort is no such work; with AVX-512 it is several times as fast, and jobs are not.
    """
    rng = np.random.default_rng(1)
    values, at = rng.random(200_000), rng.permutation(200_000)
    times = []
    for _ in range(5):
        begin = time.process_time()
        for _ in range(5):
            np.cumsum(values[at])
            np.bincount(at, values)
        sum(i * i for i in range(100_000))
        times.append(time.process_time() - begin)
    return min(times)


def free_mb() -> float:
    """Return how much memory [MB] is free, or that the group of processes which this one is limited with may use."""
    limits = []
    with suppress(OSError, ValueError):
        lines = dict(line.split(":") for line in Path("/proc/meminfo").read_text().splitlines())
        limits.append(float(lines["MemAvailable"].split()[0]) / 1e3)
    with suppress(OSError, ValueError):
        group = Path("/sys/fs/cgroup")
        most, used = (float((group / name).read_text()) for name in ("memory.max", "memory.current"))
        limits.append((most - used) / 1e6)
    return min(limits, default=float("inf"))


def words(minutes: float) -> str:
    """Return a time [min] in words."""
    if minutes < 1.5:
        return "a minute"
    return f"{minutes:.0f} minutes" if minutes < 90.0 else f"{minutes / 60:.1f} hours"
