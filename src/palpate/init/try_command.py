"""Carry out ``palpate try``: what ``palpate init`` writes, run at once on small settings.

They ask for one kind of press, few contacts, and the models that a first look needs.
"""

import re
import shlex
import subprocess
import sys
from hashlib import sha256
from pathlib import Path
from time import perf_counter
from typing import Any

import yaml

from palpate.errors import InputError
from palpate.files import PART, read_yaml, write_whole
from palpate.init.command import PICTURE, ROOT, config_file, program, run_of, typed, write_config
from palpate.init.recognise import Data
from palpate.report import tables
from palpate.report.advice_words import advice_list

CONTACTS, PRESSES = 12, 2
"""Places that are pressed, and presses at each: a bound needs nine with a truth, or no error can be promised."""
MODELS = ["linear_fem", "warped_compliance", "contact_modes", "fast_fem", "fem_p1", "fem_p2", "interpolation"]
"""Models that answer within 100 ms, or that others are measured by; those that learn need more contacts."""
PRESS = {"contacts": 32, "modes": "columns", "samples": 4}
"""Of the model in the report's page that can be pressed: on a liver from a CT 71 % of places are answered without a
doubt, and with 8 contacts 50 %, for 54 and 53 s of a core."""
_ABOUT = """\
# The small settings of palpate try, for a first look: {regime} presses only, {contacts} contacts, {models} models,
# and a mesh that is refined once. config.yaml beside this file has all; change that one, and go on with
#   {command}
"""
_MARK = "# palpate try wrote this and config.yaml: "


def small_settings(config: dict[str, Any]) -> dict[str, Any]:
    """Return what is asked of the body of a first configuration in a short run, on a mesh that is refined once."""
    regime = list(config["regimes"])[-1]
    tradeoff = config["tradeoff"]
    return {
        "bodies": {name: entry | {"refinements": 1} for name, entry in config["bodies"].items()},
        "regimes": {regime: config["regimes"][regime]},
        "tradeoff": {
            "contacts": min(CONTACTS, tradeoff["contacts"]),
            "presses": tradeoff["presses"][:PRESSES],
            "models": MODELS,
            "budget_s": 0.05,
            "truth": {"check_samples": 0},
            "advice": tradeoff["advice"],
        },
        "press": {"radius_m": config["regimes"][regime]["radius_m"], **PRESS},
    }


def write_small(config: Path) -> Path:
    """Write try.yaml beside a first configuration, marked with both files' contents; return its path."""
    settings = small_settings(read_yaml(config))
    (regime,) = settings["regimes"]
    contacts = settings["tradeoff"]["contacts"]
    about = _ABOUT.format(regime=regime, contacts=contacts, models=len(MODELS), command=run_of(config))
    text = about + yaml.safe_dump(settings, sort_keys=False, allow_unicode=True, width=120)
    file = config.with_name("try.yaml")
    with write_whole(file) as temporary:
        temporary.write_text(f"{_MARK}{_digest(config, text)}\n{text}", encoding="utf-8")
    return file


def is_unchanged(folder: Path) -> bool:
    """Return whether ``folder`` holds a config.yaml and a try.yaml as ``write_small`` left them."""
    try:
        mark, _, text = (folder / "try.yaml").read_text(encoding="utf-8").partition("\n")
        return mark == f"{_MARK}{_digest(folder / 'config.yaml', text)}"
    except (OSError, UnicodeDecodeError):
        return False


def _digest(config: Path, text: str) -> str:
    return sha256(config.read_bytes() + text.encode()).hexdigest()[:16]


FEW = 3
"""Presses that a mean error should have at least; twelve contacts leave six for it, some perhaps without a truth."""


def try_body(data: Data, folder: Path | None, hold: str | None, again: str) -> str:
    """Write a configuration, run its small settings with progress on the terminal, and return advice and what follows.

    folder, hold : as ``init`` has them; again : the command that was typed, which goes on after a stop
    Raises InputError if the data cannot be used, the folder holds anything else, or the run fails, which says why.
    """
    if not (ROOT / "Snakefile").is_file():
        raise InputError(f"{ROOT} has no workflow to run; use palpate in its own folder, where make was typed.")
    file = config_file(data, folder)
    refuse_others(file.parent)
    begun = perf_counter()
    print(
        f"trying   {data.name}: meshes it, presses it at {CONTACTS} places at most, compares {len(MODELS)} models with "
        "converged elements, and writes a report; how long that takes is said once its mesh is known",
        flush=True,
    )
    print(*write_config(data, file, hold), sep="\n", flush=True)
    small = write_small(file)
    print(f"wrote    {file}, and {small.name} with the small settings that are run now", flush=True)
    run_settings(small, again)
    return "\n".join([*_advice(file.parent), *_ways_on(file, small, perf_counter() - begun)])


def refuse_others(folder: Path) -> None:
    """Raise InputError if ``folder`` holds anything but what ``palpate try`` has left there, unchanged."""
    if is_unchanged(folder):
        if len(list(folder.glob("results/data/*/*/database.h5"))) > 1:
            raise InputError(f"{folder} holds results of all its config.yaml, and is kept; give another --folder.")
        return
    # files that a try leaves if it is killed before it has written its settings
    begun = re.compile(rf"{re.escape(PICTURE)}|{PART}")
    if not folder.exists() or (folder.is_dir() and all(begun.fullmatch(path.name) for path in folder.iterdir())):
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
    command = [sys.executable, "-m", "snakemake", *where, "--configfile", str(file.resolve())]
    if subprocess.run(command, cwd=ROOT, check=False).returncode:
        raise InputError(f"the run of {file} did not finish; what it has is kept, and {again} goes on.")


def _advice(folder: Path) -> list[str]:
    advice = tables.read(folder / "results/tables/advice.csv")
    judged = int(tables.read(folder / "results/tables/accuracy_vs_time.csv")["samples"].max())
    few = f"Errors are means over {judged} press{'es' * (judged > 1)} at contacts held out"
    if judged < FEW:
        few += ", which is too few to rely on: see the warnings above; another --hold or smaller press may help"
    return ["", advice_list(advice[advice["error"] == "rms"]), f"  {few}."]


def _ways_on(file: Path, small: Path, seconds: float) -> list[str]:
    minutes, rest_s = divmod(round(seconds), 60)
    folder, settings = file.parent, read_yaml(small)
    scene = "_".join([*settings["bodies"], *settings["regimes"]])
    return [
        "",
        f"The report: {folder / 'results/report.html'}   (after {minutes} min {rest_s} s)",
        f"The diagram of error against time: {folder / f'results/figures/work_precision_{scene}.png'}",
        f"All presses, contacts and models, after a look at the assumptions in {file}:\n  {typed(run_of(file))}",
        f"Press it:\n  {program()} press --config {shlex.quote(str(file))}",
    ]
