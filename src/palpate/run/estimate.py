"""What a run will cost: jobs, minutes and memory, from what jobs of each rule took, corrected by the last runs here.

It is right within a factor of 2 for bodies and scenes like those of config.yaml.
"""

import csv
import json
import os
import re
import time
from collections import defaultdict
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

from palpate.files import write_whole
from palpate.run.job import kernel_cache

RECORDED = Path(__file__).with_name("timings.csv")
"""By rule, and where that matters by ``of``, a wildcard: seconds of a core and megabytes of a job of config.yaml, whose
body has that many ``refinements``; on two cores of a cloud machine (AMD EPYC, November 2026)."""
TOOK = re.compile(r"^took ([\d.]+) s, ([\d.]+) s of a core$", re.MULTILINE)
"""The last line of a job's log, which ``palpate.run.job`` writes."""
UNKNOWN = (5.0, 250.0)
"""Seconds and megabytes of a job about which nothing is known, such as that of a model of the user's own."""
START_S = 0.3
COMPILE_S = 60.0
"""What all functions take to be compiled, in a first run."""
FINER_S, FINER_MB = 4.0, 8.0
"""How many times as long a job takes, and as much memory it needs, for each refinement of its body."""
FIRST_MB = 250.0
"""Memory that does not grow with the body."""
LONG_MIN = 30.0
"""Minutes from which on a run is warned of."""
SHORT_S = 5.0
"""Seconds of all jobs that count beside those of a rule in its correction."""
IN_PARALLEL = ("fit_springs",)
"""Rules whose jobs use all of their threads; others use one and hold the rest, so that their times are undisturbed."""


class Job(NamedTuple):
    """A job that has to run."""

    rule: str
    wildcards: Mapping[str, str]
    threads: int
    log: str


def jobs_of(dag: Any) -> list[Job]:
    """Return the jobs of snakemake's ``dag`` that have to run and do something.

    Snakemake tells its loggers only how many jobs each rule has, and a body or a model makes much of a difference.
    """
    return [
        Job(job.rule.name, dict(job.wildcards.items()), job.threads, str(job.log[0]) if job.log else "")
        for job in dag.needrun_jobs()
        if job.rule.script
    ]


def recorded(job: Job, bodies: Mapping[str, Mapping]) -> tuple[float, float]:
    """Return what a job like this took [s] and needed [MB] when config.yaml ran."""
    rule = next((name for name in ("draw", "merge") if job.rule.startswith(f"{name}_") and not job.wildcards), job.rule)
    table = _table()
    row = next((row for of in (*job.wildcards.values(), "") if (row := table.get((rule, of)))), None)
    if row is None:
        return UNKNOWN
    seconds, mb, refinements = row
    if refinements is not None:
        finer = bodies.get(job.wildcards.get("body", ""), {}).get("refinements", 1) - refinements
        seconds, mb = seconds * FINER_S**finer, FIRST_MB + (mb - FIRST_MB) * FINER_MB**finer
    return seconds, mb


def _table() -> dict[tuple[str, str], tuple[float, float, int | None]]:
    with RECORDED.open(encoding="utf-8") as file:
        return {
            (row["rule"], row["of"]): (
                float(row["seconds"]), float(row["mb"]), int(row["refinements"]) if row["refinements"] else None
            )
            for row in csv.DictReader(file)
        }  # fmt: skip


class Estimate:
    """What jobs will cost on this machine.

    bodies : the settings of each
    cores : of this machine, or None where jobs run on others, as on a cluster
    """

    def __init__(self, jobs: Sequence[Job], bodies: Mapping[str, Mapping], cores: int | None):
        self._jobs, self._cores, self._since = jobs, cores, time.time()
        self._first = not kernel_cache().is_dir()
        self._recorded = [recorded(job, bodies) for job in jobs]
        here = _read()
        self._seconds = [
            START_S + cost[0] * _factor(here, job.rule) for job, cost in zip(jobs, self._recorded, strict=True)
        ]

    def minutes(self) -> float:
        """Return how long the run takes [min], or how long one core of this machine would."""
        held = [
            seconds * (1 if job.rule in IN_PARALLEL else min(job.threads, self._cores or 1))
            for job, seconds in zip(self._jobs, self._seconds, strict=True)
        ]
        total = sum(held) + (COMPILE_S if self._first else 0.0)
        return max(total / (self._cores or 1), max(self._seconds, default=0.0)) / 60

    def memory_mb(self) -> float:
        """Return the most memory that jobs need which may run at one time."""
        return sum(sorted((mb for _, mb in self._recorded), reverse=True)[: self._cores or 1])

    def describe(self) -> list[str]:
        """Return lines that say what the run will cost, the warnings last."""
        if not self._jobs:
            return ["nothing to do: everything that was asked for is up to date"]
        count, minutes = f"{len(self._jobs)} job{'s' if len(self._jobs) > 1 else ''} to do", self.minutes()
        if self._cores is None:
            return [f"{count}: about {_words(minutes)} of one core of this machine"]
        on = f"{self._cores} core{'s' if self._cores > 1 else ''} of this machine"
        memory, free = self.memory_mb(), free_mb()
        lines = [f"{count}: about {_words(minutes)} on {on}, up to {memory / 1e3:.1f} GB of memory"]
        if minutes > LONG_MIN:
            most, share = self._most()
            lines.append(
                f"warning: {share:.0%} of these {_words(minutes)} are of {most}; lower its settings, or let it run."
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

    def remember(self) -> None:
        """Keep what the jobs of this run took, by rule, for the next estimate; not those that compiled functions."""
        if self._cores is None or self._first:
            return
        here = _read()
        for job, cost in zip(self._jobs, self._recorded, strict=True):
            if (seconds := _taken(job, self._since)) is not None:
                before = here.get(job.rule, (0.0, 0.0))
                here[job.rule] = (before[0] / 2 + cost[0], before[1] / 2 + seconds)
        with suppress(OSError), write_whole(_file()) as temporary:
            temporary.write_text(json.dumps(here), encoding="utf-8")


def _taken(job: Job, since: float) -> float | None:
    """Return what a job took [s] on a machine with nothing else to do, or None if it has not ended since then."""
    with suppress(OSError):
        log = Path(job.log)
        if log.stat().st_mtime >= since and (found := TOOK.findall(log.read_text(encoding="utf-8"))):
            clock, core = map(float, found[-1])
            return core if job.rule in IN_PARALLEL else min(clock, core)
    return None


def _factor(here: Mapping[str, Sequence[float]], rule: str) -> float:
    """Return how many times as long jobs of a rule take here; few seconds say little, and all jobs stand for them."""
    known, took = (sum(column) for column in zip((SHORT_S, SHORT_S), *here.values(), strict=True))
    known_of_rule, took_of_rule = here.get(rule, (0.0, 0.0))
    return (took_of_rule + SHORT_S * took / known) / (known_of_rule + SHORT_S)


def _read() -> dict[str, tuple[float, float]]:
    """Return by rule what the last jobs here took when config.yaml ran, and here [s]."""
    with suppress(OSError, ValueError, TypeError, AttributeError):
        kept = json.loads(_file().read_text(encoding="utf-8"))
        return {str(rule): (float(known), float(took)) for rule, (known, took) in kept.items()}
    return {}


def _file() -> Path:
    """Return the file of this machine, outside of any results folder, so that ``make clean`` keeps it."""
    cache = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    return Path(cache) / "palpate/seconds.json"


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


def _words(minutes: float) -> str:
    if minutes < 1.5:
        return "a minute"
    return f"{minutes:.0f} minutes" if minutes < 90.0 else f"{minutes / 60:.1f} hours"
