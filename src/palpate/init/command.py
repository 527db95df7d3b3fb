"""Carry out ``palpate init``: look at the data, choose, write the configuration with a comment on each key, report."""

import json
import re
import shlex
import shutil
import sys
import threading
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from os.path import relpath
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
import yaml

from palpate.errors import InputError
from palpate.files import templates, write_whole
from palpate.init.choose import BED_THICKNESS, Choice, choose
from palpate.init.recognise import Data, body_name, labels_of, recognise
from palpate.report.mesh_levels import draw_mesh_levels
from palpate.setting_types import plain

ROOT = Path(__file__).parents[3]  # palpate's folder, where ``make`` is typed
PICTURE = "body.png"  # the file beside a configuration that shows the body
SAME = 5e-4  # a smaller difference between volumes, as a share, is not told


def init(data: Data, folder: Path | None = None, hold: str | None = None) -> str:
    """Write config.yaml, and a picture of the body, for a mesh or a CT and perhaps its mask; return what to print.

    folder : where to; by default one beside the data that has the body's name
    hold : the side that the body lies on; chosen if it is not given
    Raises InputError if the data make no body or the file is there already; then nothing is written.
    """
    file = config_file(data, folder)
    if file.exists():
        raise InputError(f"{file} exists and is kept; delete it, or give another folder with --folder.")
    lines = write_config(data, file, hold)
    lines.append(f"wrote    {file}, with a comment on every line; change there what you know better, then")
    return "\n".join([*lines, f"  {typed(run_of(file))}"])


def config_file(data: Data, folder: Path | None) -> Path:
    """Return where the configuration goes: to ``folder``, or beside the data into a folder with the body's name.

    That is another one if the data themselves are a folder of this name.
    """
    if folder is None:
        files = data.entry.paths(Path())
        place = Path(files.get("mask") or files.get("image") or files["path"]).resolve()
        folder = place.parent / data.name
        folder = folder if folder.resolve() != place else folder.with_name(f"{data.name}_config")
        folder = folder if relpath(folder).startswith("..") else Path(relpath(folder))
    return folder / "config.yaml"


def write_config(data: Data, file: Path, hold: str | None) -> list[str]:
    """Write the configuration and a picture of the body, over what is there; return lines about what was found.

    Raises InputError if there can be no such body, or nothing can be written.
    """
    data.announce()
    with warnings.catch_warnings(record=True) as caught, ticking("the data") as say:
        warnings.simplefilter("always")
        choice = choose(data.name, data.entry, hold or data.lies or None, say)
    messages = dict.fromkeys(str(warning.message) for warning in caught if warning.category is UserWarning)
    try:
        with write_whole(file.with_name(PICTURE)) as temporary:
            draw_mesh_levels([choice.body]).savefig(temporary)
        with write_whole(file) as temporary:  # the last, as it is what tells that a folder is in use
            temporary.write_text(config_text(data, choice, file), encoding="utf-8")
    except OSError as error:
        raise InputError(f"{file} cannot be written ({error.strerror}); give another folder with --folder.") from error
    return _report(choice, list(messages), file, hold)


def init_each(
    paths: Sequence[Path],
    label: Sequence[int | str] = (),
    threshold_hu: Sequence[float] | None = None,
    folder: Path | None = None,
    mri: bool = False,
    scale_m: float | None = None,
    hold: str | None = None,
) -> str:
    """Write a configuration for each label of a mask, or for those asked for, as ``init`` does for one.

    Raises InputError after the last one if there are labels that make no body.
    """
    reports, left_out = [], []
    for each in labels_of(paths, label):
        name = body_name(each if isinstance(each, str) else f"label {each}")
        try:
            data = recognise(paths, [each], threshold_hu, mri=mri, scale_m=scale_m)
            reports.append(init(data, folder / name if folder else None, hold))
        except InputError as error:
            left_out.append(f"left out {each}: {error}")
    if left_out and reports:
        print(*reports, *left_out, sep="\n")
        raise InputError(f"{paths[1]}: {len(left_out)} labels are left out, as said above; the others are done.")
    if left_out:
        raise InputError(left_out[0].partition(": ")[2])
    return "\n".join(reports)


def run_of(file: Path) -> str:
    """Return the command that runs a configuration, as it is typed in palpate's folder."""
    seen = relpath(file, ROOT)
    return f"make CONFIG={shlex.quote(seen if seen.count('..') < 2 else str(file.resolve()))}"


def typed(command: str) -> str:
    """Return a command of palpate's folder as it is typed where we are."""
    return command if Path.cwd() == ROOT else f"cd {shlex.quote(str(ROOT))} && {command}"


def program() -> str:
    """Return how palpate is typed where we are."""
    beside = Path(sys.executable).with_name("palpate")
    if shutil.which("palpate") or not beside.exists():
        return "palpate"
    return shlex.quote(relpath(beside) if beside.is_relative_to(Path.cwd()) else str(beside))


def _report(choice: Choice, messages: list[str], file: Path, hold: str | None) -> list[str]:
    """Return lines on the body, what it lies on, its material, and the ``messages`` of warnings."""
    body, entry = choice.body, choice.entry
    sides = " × ".join(f"{side:.3g}" for side in np.ptp(choice.coarse.nodes, axis=0))
    volume = f"{1e6 * choice.coarse.volumes.sum():.4g} mL"
    meshes = " and ".join(f"{len(mesh.tetrahedra)}" for mesh in (body.coarse, body.fine))
    radius = f"{1e3 * choice.regimes['small']['radius_m']:.3g} mm"
    how = "given   " if hold else "assumed "
    return [
        f"found    a body of {sides} m and {volume}; {meshes} tetrahedra in its coarse and its fine mesh",
        *_compared(choice),
        f"{how} it {lies_on(choice)}{'' if hold else '; else give --hold'}",
        f"assumed  Young's modulus {entry.young_pa} Pa, Poisson's ratio {entry.poisson}, "
        f"density {entry.density_kg_m3} kg/m³, a fingertip of {radius} radius",
        *(f"warning: {line}" for line in messages),
        f"wrote    {file.with_name(PICTURE)}, a picture of it, with what it lies on",
    ]


def _compared(choice: Choice) -> list[str]:
    """Return a line on how far volume and surface of a mesh made anew are from the data's; a warning if far."""
    like = choice.likeness
    if like is None:
        return []
    more = f"{100 * abs(like.volume):.2g} % {'more' if like.volume > 0 else 'less'}"
    about = (
        f"the organ of the data has {1e6 * like.data_m3:.4g} mL, and the body "
        f"{'the same volume' if abs(like.volume) < SAME else more}; "
        f"their surfaces are up to {1e3 * like.away_m:.2g} mm apart ({100 * like.away:.2g} % of the size, "
        f"{100 * like.away_m / like.thick_m:.2g} % of the thickness)"
    )
    if like.close:
        return [f"found    {about}"]
    nodes = choice.entry.surface_nodes or 0
    finer = [f"{1e3 * other.away_m:.2g} mm with {count}" for count, other in choice.tried.items() if count > nodes]
    return [f"warning: {', and '.join([f'{about} with {nodes} surface nodes', *finer])}"]


@contextmanager
def ticking(step: str, every_s: float = 4.0) -> Iterator[Callable[[str], None]]:
    """Print every few seconds the step and the time that the block has taken; yield what begins the next step."""
    begun, ended = perf_counter(), threading.Event()

    def say(words: str) -> None:
        nonlocal step
        step = words

    def tick() -> None:
        while not ended.wait(every_s):
            print(f"         {step}, {perf_counter() - begun:.0f} s so far in all", flush=True)

    thread = threading.Thread(target=tick, daemon=True)
    thread.start()
    try:
        yield say
    finally:
        ended.set()
        thread.join()


TEMPLATE = "first_config.yaml"  # beside this module, with what is said of each key


def config_text(data: Data, choice: Choice, file: Path) -> str:
    """Return the configuration in YAML; its paths are relative to the folder of ``file``, where it will be."""
    folder, entry = file.parent, choice.entry
    sides = " × ".join(f"{1e3 * side:.3g}" for side in np.ptp(choice.coarse.nodes, axis=0))
    schema = Path(relpath(ROOT / ".venv/settings.schema.json", file.resolve().parent)).as_posix()
    settings = {name: plain(getattr(entry, name)) for name in entry.model_fields_set | {"kind"}}
    settings |= {name: Path(relpath(path, folder)) for name, path in entry.paths(Path()).items()}
    environment = templates(Path(__file__).parent)
    environment.filters |= {"yaml": _yaml, "two_digits": "{:.2g}".format}
    text = environment.get_template(TEMPLATE).render(
        # for editors; a file in palpate's folder may move with it
        schema=schema if file.resolve().is_relative_to(ROOT) else "",
        command=run_of(file),
        data=data,
        sides=sides,
        volume=f"{1e6 * choice.coarse.volumes.sum():.4g}",
        given=settings,
        choice=choice,
        lies_on=lies_on(choice),
    )
    return _aligned(text)


def lies_on(choice: Choice) -> str:
    """Say in words what the body lies on."""
    bed, size = choice.entry.bed, choice.coarse.size
    assert bed is not None and bed.facing is not None
    number = int(np.flatnonzero(bed.facing)[0])
    end = "largest" if bed.facing[number] > 0 else "smallest"
    thick = f"{1e3 * BED_THICKNESS * size:.2g} mm"
    return f"lies where its {'xyz'[number]} is {end} on {thick} of tissue as stiff as itself"


def _yaml(value: Any) -> str:
    """Write a value as YAML on one line, a path in quotes where YAML needs some."""
    if isinstance(value, Path):
        text, letters = value.as_posix(), re.sub("[/._-]", "", value.as_posix())
        return text if letters.isascii() and letters.isalnum() else json.dumps(text, ensure_ascii=False)
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {_yaml(inner)}" for key, inner in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_yaml, value)) + "]"
    if isinstance(value, str) and yaml.safe_load(value) == value and re.fullmatch("[a-z][a-z_]*", value):
        return value
    return f"{value:g}" if isinstance(value, float) else json.dumps(value, ensure_ascii=False)


def _aligned(text: str) -> str:
    """Put comments of lines of usual length into one column."""
    aligned = []
    for line in text.splitlines():
        code, mark, comment = line.partition("  # ")
        aligned.append(f"{code:30}  # {comment}" if mark and code.strip() else line)
    return "\n".join(aligned) + "\n"
