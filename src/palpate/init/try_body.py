"""Carry out ``palpate try``: what ``palpate init`` writes, run at once on small settings."""

import os
import shlex
import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from time import perf_counter

from palpate.errors import InputError
from palpate.figures import tables
from palpate.init.command import ROOT, config_file, run_of, typed, write_config
from palpate.init.data import Data
from palpate.init.small_settings import is_unchanged, write_small
from palpate.report.advice_list import advice_list

RUN = ROOT / "workflow/run.py"
"""Runs snakemake, as make does."""


def try_body(data: Data, paths: Sequence[Path], folder: Path | None, hold: str | None, again: str) -> str:
    """Write a configuration, run its small settings with progress on the terminal, and return advice and what follows.

    folder, hold : as ``init`` has them; again : the command that was typed, which goes on after a stop
    Raises InputError if the data cannot be used, the folder holds anything else, or the run fails, which says why.
    """
    if not RUN.is_file():
        raise InputError(f"{ROOT} has no workflow to run; use palpate in its own folder, where make was typed.")
    file = config_file(data, paths, folder)
    refuse_others(file.parent)
    begun = perf_counter()
    print(*write_config(data, file, hold), sep="\n", flush=True)
    small = write_small(file, run_of(file))
    print(f"wrote    {file}, and {small.name} with the small settings that are run now", flush=True)
    run_settings(small, again)
    return "\n".join([*_advice(file.parent), *_ways_on(file, perf_counter() - begun)])


def refuse_others(folder: Path) -> None:
    """Raise InputError if ``folder`` holds anything but what ``palpate try`` has left there, unchanged."""
    if not folder.exists() or (folder.is_dir() and not any(folder.iterdir())) or is_unchanged(folder):
        return
    if (folder / "try.yaml").is_file() and (folder / "config.yaml").is_file():
        go_on = typed(run_of(folder / "config.yaml"))
        raise InputError(f"{folder}/config.yaml or try.yaml was changed and is kept; run it with {go_on}.")
    raise InputError(f"{folder} exists and is kept; delete it, or give another folder with --folder.")


def run_settings(file: Path, again: str) -> None:
    """Run a file of settings in its folder, as ``make CONFIG=`` does; InputError if that fails, after its own words.

    again : the command to type after a stop
    """
    where = ["--workflow-profile", str(ROOT / "profiles/default"), "--directory", str(file.parent.resolve())]
    command = [sys.executable, str(RUN), "snakemake", *where, "--configfile", str(file.resolve())]
    run = subprocess.Popen(command, cwd=ROOT, env=os.environ | {"PALPATE_COMMAND": again})
    before = signal.signal(signal.SIGTERM, lambda *_: run.terminate())
    try:
        code = _waited(run)
    finally:
        signal.signal(signal.SIGTERM, before)
    if code:
        raise InputError(f"the run of {file} ended before its end; what it has is kept, and {again} goes on.")


def _waited(run: subprocess.Popen) -> int:
    """Wait for a run, which ends by itself at Ctrl-C; KeyboardInterrupt after that."""
    stopped = False
    while True:
        try:
            code = run.wait()
        except KeyboardInterrupt:
            stopped = True
        else:
            if stopped:
                raise KeyboardInterrupt
            return code


def _advice(folder: Path) -> list[str]:
    advice = tables.read(folder / "results/tables/advice.csv")
    return ["", advice_list(advice[advice["error"] == "rms"])]


def _ways_on(file: Path, seconds: float) -> list[str]:
    """Return where the results are, and how to go on."""
    minutes, rest = divmod(round(seconds), 60)
    folder = file.parent
    (diagram,) = sorted((folder / "results/figures").glob("work_precision_*.png"))
    return [
        "",
        f"The report: {folder / 'results/report.html'}   (after {minutes} min {rest} s)",
        f"The diagram of error against time: {diagram}",
        f"All presses, contacts and models, after a look at the assumptions in {file}:\n  {typed(run_of(file))}",
        f"Press it:\n  palpate press --config {shlex.quote(str(file))}",
    ]
