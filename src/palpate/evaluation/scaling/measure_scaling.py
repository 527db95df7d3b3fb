"""How cost and memory of each kernel grow with its size, far beyond what runs in real time."""

import gc
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np
import pandas as pd

from palpate.evaluation.scaling import scaling_enrichment, scaling_kernels
from palpate.evaluation.scaling.scaling_growth import exponents

LONG_S = 0.5
"""A call that takes longer is timed once; of shorter ones the median counts, of as many as take so long."""

KERNELS = {
    "fem": scaling_kernels.fem,
    "fine_nodes": scaling_enrichment.fine_nodes,
    "samples": scaling_enrichment.samples,
    "triangles": scaling_kernels.triangles,
    "particles": scaling_kernels.particles,
    "cores": scaling_kernels.cores,
}
"""What grows, by its key in the config: run at a size with a Meter, says what counts the size, and how large it is."""


class Meter:
    """Seconds and memory of the stages of one kernel at one size, the memory since it was made.

    clock : processor time of this thread, which leaves out what else the machine does; ``time.perf_counter`` where
        several threads work
    """

    def __init__(self, clock: Callable[[], float] = time.thread_time):
        gc.collect()
        self.clock, self.stages = clock, []
        self._before = _resident_mb("VmRSS")

    def once(self, stage: str, call: Callable, *given) -> object:
        """Time one call; what it gives."""
        return self._timed(stage, call, given, 0.0)

    def often(self, stage: str, call: Callable, *given) -> object:
        """Time as many calls as take LONG_S, one at least; what the last of them gives."""
        return self._timed(stage, call, given, LONG_S)

    def _timed(self, stage: str, call: Callable, given: tuple, patience: float) -> object:
        _forget_peak()
        seconds = []
        while not seconds or sum(seconds) < patience:
            start = self.clock()
            result = call(*given)
            seconds.append(self.clock() - start)
        grown = max(0.0, _resident_mb("VmHWM") - self._before)
        self.stages.append({"stage": stage, "seconds": float(np.median(seconds)), "memory_mb": grown})
        return result


def measure(kernel: str, sizes: list[int], tell: Callable[[int], None] = lambda size: None) -> pd.DataFrame:
    """Rows of scaling.csv of one of KERNELS: a row a size and stage.

    seconds : one call, see Meter; memory_mb : the most that the process had grown by then (1e6 bytes resident), which
    small sizes hide in what it had before. Their exponents are those of the stage. ``tell`` gets each size that is
    done.
    """
    run = KERNELS[kernel]
    clock = time.perf_counter if kernel == "cores" else time.thread_time
    run(sizes[0], Meter(clock))  # compiles what is called
    rows = []
    for asked in sizes:
        meter = Meter(clock)
        unit, size = run(asked, meter)
        threads = size if kernel == "cores" else 1
        rows += [{"kernel": kernel, "unit": unit, "size": size, **stage, "threads": threads} for stage in meter.stages]
        tell(size)
    table = pd.DataFrame(rows)
    return table.merge(exponents(table), on=["kernel", "stage"])


def doubling(most: int) -> list[int]:
    """1, 2, 4 … up to ``most``, which is among them."""
    return [2**k for k in range(most.bit_length()) if 2**k < most] + [most]


def _forget_peak() -> None:
    """Have the kernel count the peak of the resident memory anew, where it can."""
    with suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")


def _resident_mb(what: str) -> float:
    """Resident memory of this process, now (VmRSS) or at its peak (VmHWM) [1e6 bytes]; 0 where nobody tells."""
    status = Path("/proc/self/status")
    lines = status.read_text().splitlines() if status.exists() else []
    return sum(1.024e-3 * float(line.split()[1]) for line in lines if line.startswith(f"{what}:"))
