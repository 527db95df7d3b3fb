"""Run jobs side by side in thought: when the last one ends, and how much memory they need at a time."""

from collections.abc import Sequence
from heapq import heappop, heappush
from typing import NamedTuple

from palpate.plan.work import Job


class Course(NamedTuple):
    """The course of a run: its duration [s], and the most memory [MB] that jobs need at one time."""

    seconds: float
    memory_mb: float


def follow(jobs: Sequence[Job], seconds: Sequence[float], memory_mb: Sequence[float], cores: int) -> Course:
    """Start every job as soon as those before it have ended and its threads are free, in the given order.

    seconds, memory_mb : of each job
    """
    waiting = [len(job.after) for job in jobs]
    followers: list[list[int]] = [[] for _ in jobs]
    for i, job in enumerate(jobs):
        for earlier in job.after:
            followers[earlier].append(i)
    ready = [i for i, count in enumerate(waiting) if not count]
    running: list[tuple[float, int]] = []
    now, free, held, most = 0.0, cores, 0.0, 0.0
    while ready or running:
        for i in list(ready):
            if (threads := min(jobs[i].threads, cores)) <= free:
                ready.remove(i)
                free -= threads
                held += memory_mb[i]
                heappush(running, (now + seconds[i], i))
        most = max(most, held)
        now, ended = heappop(running)
        free += min(jobs[ended].threads, cores)
        held -= memory_mb[ended]
        for i in followers[ended]:
            waiting[i] -= 1
            if not waiting[i]:
                ready.append(i)
        ready.sort()
    return Course(now, most)
