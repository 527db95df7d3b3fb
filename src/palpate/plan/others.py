"""Find how much of this machine other programs use, and by how much that slows a run."""

from contextlib import suppress
from typing import NamedTuple

LOOK_S = 0.3
"""How long the machine is looked at."""
FULL = 0.9
"""Share of the processors from which on they are taken for full, so that some programs wait for others."""


class Others(NamedTuple):
    """Processors that other programs ``use`` or wait for, of the ``processors`` of this machine."""

    use: float
    processors: int

    def slow(self, used: float) -> float:
        """Return how many times as long a run takes that has ``used`` processors alone; all have equal shares."""
        return max(1.0, (used + self.use) / self.processors)


def look() -> Others:
    """Look at what other programs use now; this one's processes do not count, such as a job server that begins."""
    import psutil

    processors, before = psutil.cpu_count() or 1, own_seconds()
    share = psutil.cpu_percent(LOOK_S) / 100
    own = (own_seconds() - before) / LOOK_S
    waiting = psutil.getloadavg()[0] if share > FULL else 0.0  # a mean of the last minute, which may have been another
    return Others(max(share * processors - own, waiting - own, 0.0), processors)


def own_seconds() -> float:
    """Return what this process and those that it has started have used of the processors [s]."""
    import psutil

    this, total = psutil.Process(), 0.0
    for process in [this, *this.children(recursive=True)]:
        with suppress(psutil.NoSuchProcess):  # it has ended since
            used = process.cpu_times()
            total += used.user + used.system
    return total
