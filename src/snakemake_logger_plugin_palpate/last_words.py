"""Find the sentence that explains why a run failed."""

import logging
import os
import re
import time
from pathlib import Path
from typing import Any

from snakemake_interface_logger_plugins.common import LogEvent

from palpate.run.job import FAILED
from palpate.run.system_faults import of_exit
from snakemake_logger_plugin_palpate.explain import explain, quote

RESULTS = "results"


class LastWords:
    """What failed in a run, and what to print about it when the run is over.

    names : what each job does, by its number
    """

    def __init__(self) -> None:
        self.names: dict[int, str] = {}
        self._began = time.time()
        self._statuses: dict[int | None, int] = {}
        self._sentences: dict[str, None] = {}
        self._logs: dict[str, None] = {}
        self._errors: list[tuple[str, str]] = []

    def note(self, record: Any) -> str:
        """Keep a record of an error; return the line to print at once, if any."""
        event, text = getattr(record, "event", None), record.getMessage()
        if event == LogEvent.JOB_ERROR:
            return self._note_job(record)
        if event == LogEvent.ERROR:
            # the thread that ran a job reports first how its process ended, and then the job
            if status := _status(text):
                self._statuses[record.thread] = status
            else:
                self._errors.append((record.exception, text))
        return ""

    def lines(self) -> list[str]:
        """Return the last lines on the terminal: where the logs are, and one sentence for each fault."""
        if any(kind == "BrokenPipeError" for kind, _ in self._errors):  # whoever reads has had enough
            return []
        sentences = list(self._sentences)
        if not sentences and self._errors:
            if sentence := explain(self._errors):
                return [f"{FAILED}{sentence}"]
            sentences = [quote(self._errors)]
        logs = [_as_typed(log) for log in [*self._logs, *_log_of_snakemake()]] if sentences else []
        return [*([f"logs: {', '.join(logs)}"] if logs else []), *(f"{FAILED}{sentence}" for sentence in sentences)]

    def _note_job(self, record: Any) -> str:
        status = self._statuses.pop(record.thread, None)
        logs = [Path(log) for log in record.log]
        said = {log: sentence for log in logs if (sentence := self._read(log))}
        what = self.names.get(record.jobid, record.rule_name)
        if said:
            sentence = next(iter(said.values()))
        elif getattr(record, "indent", False):  # of a group whose other jobs may have failed
            return ""
        else:
            why = f"its SLURM job failed ({record.rule_msg})." if record.rule_msg else of_exit(status or 1, RESULTS)
            sentence = f"{what}: {why}"
        self._sentences[sentence] = None
        self._logs |= dict.fromkeys(str(log) for log in said or logs if log.is_file())
        return f"failed: {what}"

    def _read(self, log: Path) -> str:
        """Return the sentence that a job of this run wrote to its log; empty if there is none."""
        try:
            if log.stat().st_mtime < self._began:
                return ""
            lines = [line for line in log.read_text(encoding="utf-8").splitlines() if line.startswith(FAILED)]
        except OSError:
            return ""
        return lines[-1].removeprefix(FAILED) if lines else ""


def _status(text: str) -> int:
    """Return the exit status of a job's process that snakemake reports, a negative number for a signal; else 0."""
    if ended := re.search(r"returned non-zero exit status (\d+)", text):
        return int(ended[1])
    if killed := re.search(r"died with <Signals\.\w+: (\d+)>", text):
        return -int(killed[1])
    return 0


def _log_of_snakemake() -> list[str]:
    handlers = logging.getLogger("snakemake.logging").handlers
    return [handler.baseFilename for handler in handlers if isinstance(handler, logging.FileHandler)]


def _as_typed(file: str) -> str:
    """Return the path of a file as it is typed where the command was, which may be another folder than the run's."""
    typed = os.path.relpath(file, os.environ.get("PWD", "."))
    return str(Path(file).absolute()) if typed.startswith("..") else typed
