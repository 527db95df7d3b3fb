"""Take the jobs of a run from snakemake's plan, and what they took from their logs afterwards."""

import re
from pathlib import Path
from typing import Any

from palpate.plan.work import Job

TOOK = re.compile(r"^took ([\d.]+) s, ([\d.]+) s of a core$", re.MULTILINE)
"""The last line of a job's log, which ``palpate.run.job`` writes."""
PARALLEL = {"fit_springs genetic", "fit_springs cma_es"}
"""Beginnings of kinds of jobs that use all of their threads; the others use one."""


def jobs_of(dag: Any) -> list[Job]:
    """Return the jobs of snakemake's ``dag`` that have to run and do something."""
    needed = [job for job in dag.needrun_jobs() if job.rule.script]
    number = {job: i for i, job in enumerate(needed)}
    return [
        Job(
            job.rule.name,
            dict(job.wildcards.items()),
            str(job.log[0]) if job.log else "",
            job.threads,
            tuple(sorted(number[other] for other in dag.dependencies[job] if other in number)),
        )
        for job in needed
    ]


def is_parallel(kind: str) -> bool:
    """Return whether jobs of a kind use all of their threads."""
    return any(kind.startswith(beginning) for beginning in PARALLEL)


def seconds_taken(log: Path, since: float, parallel: bool) -> float | None:
    """Return what a job took [s] on a machine with nothing else to do, or None if it has not ended since then.

    since : a time as of ``time.time``
    parallel : whether to count the seconds of all cores
    """
    try:
        found = TOOK.findall(log.read_text(encoding="utf-8")) if log.stat().st_mtime >= since else []
    except OSError:
        return None
    if not found:
        return None
    clock, cores = map(float, found[-1])
    return cores if parallel else min(clock, cores)
