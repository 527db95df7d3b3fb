"""How much longer a run takes, job by job."""

import time
from typing import Protocol


class Estimate(Protocol):
    """What ``palpate.run.estimate`` offers."""

    def minutes_left(self, ended: set[str], running: dict[str, float]) -> float:
        """Return how long the rest of a run takes [min]; both by the logs of jobs, with the seconds that they ran."""


LEAST_MIN = 1.5
"""Minutes below which nothing is said."""
_watched: list[Estimate] = []


def watch(estimate: Estimate) -> None:
    """Have lines about jobs say what is left by this estimate."""
    _watched[:] = [estimate]


class Jobs:
    """The jobs of a run that have begun and ended, by their logs."""

    def __init__(self) -> None:
        self._logs: dict[int, str] = {}
        self._begun: dict[str, float] = {}
        self._ended: set[str] = set()

    def begin(self, number: int, log: str) -> None:
        """Note that a job begins."""
        self._logs[number], self._begun[log] = log, time.monotonic()

    def end(self, number: int) -> None:
        """Note that a job has ended."""
        if log := self._logs.get(number):
            self._ended.add(log)

    def left(self) -> str:
        """Return how much longer the run takes, such as ", 12 min left"; nothing if that is short or not known."""
        if not _watched:
            return ""
        running = {log: time.monotonic() - begun for log, begun in self._begun.items() if log not in self._ended}
        minutes = _watched[0].minutes_left(self._ended, running)
        return f", {minutes:.0f} min left" if minutes >= LEAST_MIN else ""
