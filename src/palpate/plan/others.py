"""Find how much of this machine other programs use, and by how much that slows a run."""

from typing import NamedTuple

LOOK_S = 0.3
"""How long the machine is looked at."""


class Others(NamedTuple):
    """Processors that other programs ``use`` on average, of the ``processors`` of this machine."""

    use: float
    processors: int

    def slow(self, cores: int) -> float:
        """Return how many times as long a run on ``cores`` takes beside them; all programs have equal shares."""
        return max(1.0, (cores + self.use) / self.processors)


def look() -> Others:
    """Look at what other programs use now, while this one does nothing."""
    import psutil

    processors = psutil.cpu_count() or 1
    return Others(psutil.cpu_percent(LOOK_S) / 100 * processors, processors)
