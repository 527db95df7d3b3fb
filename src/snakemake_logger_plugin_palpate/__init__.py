"""Show a run of the workflow on the terminal: which job begins, and at the end what failed, in one sentence.

Snakemake finds this package by its name, and ``logger: palpate`` in a profile asks for it. Snakemake's own words are
all in .snakemake/log.
"""

import logging
import os
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol

from snakemake_interface_logger_plugins.base import LogHandlerBase
from snakemake_interface_logger_plugins.common import LogEvent

from snakemake_logger_plugin_palpate import interrupt
from snakemake_logger_plugin_palpate.last_words import LastWords, goals

_SILENT = ("Assuming unrestricted shared filesystem usage.", "None")
_NOTHING = "Nothing to be done"


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


class LogHandler(LogHandlerBase):
    """The terminal of a run: one line a job, and the last words."""

    writes_to_stream = True
    writes_to_file = False
    has_filter = True
    has_formatter = False
    needs_rulegraph = False

    def __post_init__(self) -> None:
        """Listen for Ctrl-C from the beginning on."""
        from snakemake.logging import ColorizingTextHandler, DefaultFilter

        logging.raiseExceptions = False  # or a full disk fills the screen with the log's own tracebacks
        given = self.common_settings
        self.usual = ColorizingTextHandler(given.nocolor, sys.stdout if given.stdout else sys.stderr)
        wanted = (given.quiet, given.debug_dag, given.verbose, given.dryrun, given.printshellcmds)
        self.usual.addFilter(DefaultFilter(*wanted))
        self.running, self.closed, self.total, self.begun = False, False, 0, 0
        self.last_words, self.jobs = LastWords(), Jobs()
        interrupt.listen()
        _find_cache()

    def emit(self, record: logging.LogRecord) -> None:
        """Print a line for a job that begins or fails, and keep errors for the end.

        A plan (``--dry-run``), a list (``--list-rules``) and ``--verbose`` are printed as snakemake does.
        """
        event, given = getattr(record, "event", None), self.common_settings
        if record.levelno >= logging.ERROR:
            if not interrupt.requested and (line := self.last_words.note(record)):
                self._say(line)
        elif event == LogEvent.WORKFLOW_STARTED:
            self.running = not given.dryrun
        elif given.verbose or given.debug_dag or not self.running:
            if record.getMessage() not in _SILENT:
                self.usual.setFormatter(self.formatter)
                self.usual.handle(record)
        elif not interrupt.requested:
            self._follow(event, record)

    def _follow(self, event: LogEvent | None, record: Any) -> None:
        if event == LogEvent.RUN_INFO:
            self.total = record.stats["total"] - sum(record.stats.get(name, 0) for name in goals())
        elif event == LogEvent.JOB_INFO and record.rule_name in goals():
            self.last_words.names[record.jobid] = record.rule_name
        elif event == LogEvent.JOB_INFO:
            self.begun += 1
            what = _words(record.rule_name, record.wildcards)
            self.last_words.names[record.jobid] = what
            self.jobs.begin(record.jobid, record.log[0] if record.log else "")
            self._say(f"{self.begun} of {self.total}{self.jobs.left()}: {what}")
        elif event == LogEvent.JOB_FINISHED:
            self.jobs.end(record.job_id)
        elif record.levelno == logging.WARNING:
            self._say(f"warning: {record.getMessage().strip()}")
        elif record.getMessage().startswith(_NOTHING):
            self._say("everything is up to date")

    def _say(self, line: str) -> None:
        print(line, file=sys.stderr, flush=True)

    def close(self) -> None:
        """Print the last words; snakemake calls this when everything else is over."""
        if not self.closed:
            self.closed = True
            interrupt.tidy_up()
            stopped = [f"stopped; type {command()} to go on"]
            for line in stopped if interrupt.requested else self.last_words.lines():
                self._say(line)
        super().close()


def _words(rule: str, wildcards: Mapping[str, str]) -> str:
    """Say what a job does: "make body (liver)"."""
    of = f" ({', '.join(wildcards.values())})" if wildcards else ""
    return rule.replace("_", " ") + of


def _find_cache() -> None:
    """Let snakemake keep its cache in the folder of the run where there is no home to write to."""
    from snakemake.common import get_appdirs

    folder = Path(get_appdirs().user_cache_dir)
    while not folder.exists():
        folder = folder.parent
    if not os.access(folder, os.W_OK) or folder == Path("/proc"):
        os.environ["XDG_CACHE_HOME"] = str(Path(".snakemake/cache").absolute())


def command() -> str:
    """Return what a user types to run this again."""
    import shlex

    return os.environ.get("PALPATE_COMMAND") or shlex.join(["snakemake", *sys.argv[1:]])
