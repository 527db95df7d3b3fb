"""Find the sentence that explains why a run failed, with the remedy or the nearest name of what can be asked for."""

import logging
import os
import re
import sys
import time
from difflib import get_close_matches
from pathlib import Path, PurePath
from typing import Any

from snakemake_interface_logger_plugins.common import LogEvent

from palpate.errors import InputError
from palpate.run.job import FAILED
from palpate.run.settings_yaml import read_settings
from palpate.run.system_faults import of_exit, of_text

RESULTS = "results"
_LAST = "At least one job did not complete successfully."
# what can be asked for: the studies in the settings, all studies, and the files that can be made
_asked: list[str] = []
_studies: list[str] = []
_files: list[str] = []


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


def explain(errors: list[tuple[str, str]]) -> str:
    """Return the sentence for the errors of a run; empty for what is not foreseen.

    errors : the exception's class and snakemake's text for each, oldest first
    """
    return next((sentence for kind, text in errors if (sentence := _known(kind, text))), "")


def quote(errors: list[tuple[str, str]]) -> str:
    """Return an error that is not foreseen in one line, for whom the log is of use."""
    kind, text = next((error for error in errors if _LAST not in error[1]), errors[0])
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    # of a traceback, the last line says what happened
    line = lines[-1] if lines and lines[0].startswith("Traceback") else " ".join(lines)[:300]
    return f"snakemake stopped ({line or kind}); its log says where."


def _known(kind: str, text: str) -> str:
    if found := re.search(r"No rule to produce (.+?) \(if you use", text):
        return nearest_target(found[1])
    if found := re.search(r"(?:InputError|palpate\.errors\.InputError)[^\n]*?:\s*(.+)", text):
        return found[1].strip()
    if kind == "FileNotFoundError" and (found := re.search(r"'([^']+)'\s*$", text)) and found[1] in sys.argv:
        return f"{found[1]} is missing; check its path (targets stand after --, apart from files of settings)."
    if sentence := _of_settings():
        return sentence
    if found := re.search(r"KeyError: '(\w+)'.*\b(\w+)=\1\b", text, re.S):
        return f"nothing in the settings is called {found[1]}; check the name of the {found[2]} that was asked for."
    if kind == "MissingInputException":
        files = text.partition("affected files:")[2].split()
        return f"{', '.join(files[:3])} cannot be found, and nothing makes it; put it there, or remove what names it."
    if "No Snakefile found" in text:
        return "there is no Snakefile in this folder; go to palpate's folder, or name its Snakefile with -s."
    return of_text(text)


def _of_settings() -> str:
    """Return what is wrong with the files of settings on the command line: snakemake itself gives no line."""
    for word in sys.argv[1:]:
        if Path(word).suffix in (".yaml", ".yml", ".json") and Path(word).is_file():
            try:
                read_settings(Path(word))
            except InputError as error:
                return str(error)
    return ""


def offer(asked: list[str], studies: list[str], files: list[str]) -> None:
    """Say what can be asked for: the studies in the settings, all studies, and the files that can be made."""
    _asked[:], _studies[:], _files[:] = asked, studies, files


def goals() -> list[str]:
    """Return the names of rules that make nothing, but ask for others."""
    return ["all", *_studies]


def nearest_target(target: str) -> str:
    """Return one sentence about a target that nothing makes, with the nearest name."""
    if target in _studies:
        return f"{target} has no block in the settings; add {target}: to them."
    names = {short(file): file for file in _files}
    wanted = short(target)
    if study := get_close_matches(wanted.lower(), _asked, n=1, cutoff=0.7):
        return f"nothing makes {wanted}; did you mean {study[0]}?"
    stem = wanted.rpartition("/")[2]
    near = [name for name in names if name.rpartition("/")[2] == stem]
    stems = {name.rpartition("/")[2]: name for name in names}
    near = near or [stems.get(name, name) for name in get_close_matches(stem, [*_asked, *stems], n=1, cutoff=0.7)]
    near = near or get_close_matches(wanted, list(names), n=1, cutoff=0.8)
    if near:
        return f"nothing makes {wanted}; did you mean {' or '.join(near[:3])}?"
    return f"nothing makes {wanted}; ask for one of {', '.join(_asked)}, or for a file, such as results/report.html."


def short(file: str) -> str:
    """Return a file's name as ``make`` takes it: figures/errors for results/figures/errors.png."""
    path = PurePath(file)
    if path.parts[:2] in (("results", "figures"), ("results", "tables")) and len(path.parts) == 3:
        return f"{path.parts[1]}/{path.stem}"
    return file
