"""Stop a run at Ctrl-C or at a request to end: its jobs first, then the run, and no half-written file stays."""

import os
import signal
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import psutil

from palpate.run.leftovers import remove_leftovers

requested = False
"""Whether this run was asked to stop."""
_has_jobs = False
PATIENCE_S = 5
"""How long a job may take to end before it is killed."""


def listen(has_jobs: bool = False) -> None:
    """Stop at SIGINT and SIGTERM.

    has_jobs : whether the processes that this one starts are jobs; on a cluster they are what cancels the jobs

    Trap: snakemake's scheduler sets a handler of its own, which waits for the jobs, so call this again after it.
    """
    global _has_jobs
    _has_jobs = has_jobs

    def stop(*_: Any) -> None:
        global requested
        if not requested:
            requested = True
            print("stopping ...", file=sys.stderr, flush=True)
            if has_jobs:
                threading.Thread(target=_end_jobs, daemon=True).start()
            sys.exit(128 + signal.SIGINT)

    if threading.current_thread() is threading.main_thread():
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, stop)


def tidy_up() -> None:
    """Remove what jobs of this machine that were ended or have crashed left half-written."""
    if _has_jobs:
        remove_leftovers(Path("results"))


def _end_jobs() -> None:
    """End the jobs of this process, those that begin meanwhile too; they pay no heed to the terminal's Ctrl-C."""
    begin, run = time.monotonic(), psutil.Process(os.getpid())
    while True:
        for job in run.children(recursive=True):
            with suppress(psutil.NoSuchProcess):
                job.kill() if time.monotonic() - begin > PATIENCE_S else job.terminate()
        time.sleep(0.1)
