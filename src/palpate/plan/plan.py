"""The plan of a run: its jobs as snakemake knows them before the first one starts, and what they will cost."""

import logging
import time
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import Any

from palpate.plan.describe import case_of, describe
from palpate.plan.jobs import is_parallel, jobs_of, seconds_taken
from palpate.plan.others import look
from palpate.plan.timings import read_timings, remember
from palpate.plan.work import amounts, kind_of
from palpate.run.job import kernel_cache


class Plan:
    """The jobs that snakemake's ``dag`` will run under settings whose paths are relative to ``folder``.

    cores : of this machine, or None where jobs run on others
    """

    def __init__(self, dag: Any, config: dict, folder: Path, cores: int | None):
        self._jobs, self._cores, self._since = jobs_of(dag), cores, time.time()
        # whether functions have to be compiled
        self._first = not kernel_cache().is_dir()
        self._case, self._timings = case_of(config, self._jobs, folder), read_timings()

    def describe(self) -> list[str]:
        """Return what the run will cost, a line each, warnings last."""
        others = look() if self._jobs and self._cores else None
        return describe(self._jobs, self._case, self._timings, self._cores, self._first, others)

    def remember(self) -> None:
        """Keep the times of the jobs that have ended since the plan was made, if they ran on this machine.

        Those of a first run are not kept, as compiling was a part of them.
        """
        if self._cores is None or self._first:
            return
        taken: dict[str, list[list[float]]] = defaultdict(list)
        for job in self._jobs:
            kind = kind_of(job, self._case)
            seconds = seconds_taken(Path(job.log), self._since, is_parallel(kind))
            if seconds is not None:
                taken[kind].append([self._timings.shipped_seconds(kind, amounts(job, self._case)), seconds])
        remember(taken)


class _Listener(logging.Filter):
    """Lets every record pass, and calls a function at the first that comes when all jobs are known."""

    def __init__(self, call: Callable[[], object]):
        super().__init__()
        self._call: Callable[[], object] | None = call

    def filter(self, record: logging.LogRecord) -> bool:
        known = getattr(record, "event", None) == "run_info" or record.getMessage().startswith("Nothing to be done")
        if known and self._call is not None:
            call, self._call = self._call, None
            call()
        return True


def when_known(call: Callable[[], object]) -> None:
    """Call a function once snakemake knows which jobs it will run; trap: its own hook is not called in a dry run."""
    from snakemake.logging import logger

    logger.addFilter(_Listener(call))
