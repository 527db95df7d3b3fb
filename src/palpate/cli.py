"""The command ``palpate``: own data set up and tried, bodies pressed, advice from a run, models, questions."""

import argparse
import math
import os
import re
import shlex
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any, NoReturn

from palpate.errors import InputError, explained
from palpate.run.job import kernel_cache

if TYPE_CHECKING:
    from palpate.effects.instrument import Instrument
    from palpate.init.recognise import Data


class _Parser(argparse.ArgumentParser):
    """Says what is wrong in one sentence, like all of palpate."""

    def error(self, message: str) -> NoReturn:
        raise InputError(f"{self.prog}: {message}; see {self.prog} --help.")


def main(arguments: list[str] | None = None) -> int:
    """Run the command; 0, or 1 with one sentence on standard error if something given cannot be used."""
    try:
        parsed = _parser().parse_args(arguments)
        os.environ.setdefault("NUMBA_CACHE_DIR", str(kernel_cache()))  # where make keeps compiled functions
        with explained():
            print(_call(**vars(parsed)) if isinstance(parsed.act, str) else parsed.act(parsed), flush=True)
    except BrokenPipeError:  # whoever reads has had enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except KeyboardInterrupt:
        print("stopped", file=sys.stderr)
        return 130
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    except OSError as error:  # such as a folder that may not be read, or a full disk
        if error.filename is None:
            raise
        print(f"error: {error.filename}: {error.strerror}; mend that, or give another place.", file=sys.stderr)
        return 1
    return 0


def _call(act: str, **options: Any) -> str:
    """Call the function ``act``, "module:name", whose arguments are the options of a command."""
    return resolve_name(act)(**options)


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(prog="palpate", description=__doc__)
    commands = parser.add_subparsers(required=True, metavar="command")
    init = commands.add_parser("init", help="write a config.yaml for a mesh, or for a CT and perhaps its mask")
    _add_data(init).add_argument("--each", action="store_true", help="a config for each label, not one body of all")
    init.set_defaults(act=_init)
    tried = commands.add_parser("try", help="the same, and run small settings of it at once: advice in minutes")
    _add_data(tried)
    tried.set_defaults(act=_try)
    press = commands.add_parser("press", help="open a body of a finished run in the browser, to be pressed")
    press.add_argument("--scene", help="a body and a regime of loads, such as liver_small; else the run's first")
    press.add_argument("--config", type=Path, metavar="FILE", help="settings of the run (config.yaml)")
    press.add_argument("--results", type=Path, metavar="DIR", help="folder that make has filled; else beside them")
    press.add_argument("--model", help="the model that answers; else those that answer anywhere")
    press.add_argument("--port", type=_port, default=0, help="port of this machine; else any that is free")
    press.add_argument("--no-browser", dest="browser", action="store_false", help="print the address only")
    press.set_defaults(act="palpate.press.serve.command:press")
    advise = commands.add_parser("advise", help="which model to take, its error, and its time")
    advise.add_argument("--scene", help="a body and a regime of loads, such as liver_small, or one that moves; or all")
    limit = advise.add_mutually_exclusive_group()
    limit.add_argument(
        "--budget-ms", type=_positive, help="time for one answer, or one step [ms]: 16.7 for 60 pictures a second"
    )
    limit.add_argument(
        "--max-error", type=_share, help="largest error of nine answers in ten, as a share of the peak displacement"
    )
    advise.add_argument(
        "--speed", type=_positive,
        help="of a scene that moves: seconds of motion in a second, such as 20; also beside --max-error",
    )  # fmt: skip
    advise.add_argument(
        "--error", choices=["rms", "patch", "force"],
        help="over the whole surface (rms, if left out), where it is pressed, or of an instrument's force",
    )  # fmt: skip
    advise.add_argument(
        "--load", choices=["prepared", "never-prepared", "two-contacts", "depth", "all"],
        help="another kind of load: a place never prepared, two contacts at once, a disc pushed to a depth; or all",
    )  # fmt: skip
    advise.add_argument("--results", default="results", metavar="DIR", help="folder that make has filled (results)")
    advise.set_defaults(act=_advise)
    export = commands.add_parser("export", help="write a prepared model to one file, for other programs")
    export.add_argument("--scene", required=True, help="a body and a regime of loads, such as liver_large")
    export.add_argument("--model", default="contact_modes", help="contact_modes, the one that a file can hold")
    export.add_argument("--contacts", type=_count, default=120, help="places to prepare, spread over the surface (120)")
    export.add_argument(
        "--instrument", action="append", default=[], metavar="KIND:RADIUS_M[:EDGE_M]",
        help="a rigid instrument to prepare places for, such as sphere:0.008 or punch:0.008:0.002; may be repeated",
    )  # fmt: skip
    export.add_argument("--places", type=_count, default=4, help="places of each instrument, some 15 s each (4)")
    export.add_argument("--out", required=True, type=Path, metavar="FILE", help="the file to write, and its folder")
    export.add_argument("--config", default="config.yaml", type=Path, help="the file of settings (config.yaml)")
    export.set_defaults(act=_export)
    _add_identify(commands.add_parser("identify", help="stiffness and law of tissue from presses, and what stays open"))
    load = commands.add_parser("load", help="check a file that palpate export wrote, and say what it is")
    load.add_argument("path", metavar="file", help="the file")
    load.set_defaults(act="palpate.press.portable.file:describe")
    ask = commands.add_parser("ask", help="write the questions of a scene to a folder, for any engine to answer")
    ask.add_argument("--scene", required=True, help="presses, touches or a motion, such as liver_large")
    ask.add_argument("--out", required=True, type=Path, metavar="DIR", help="the folder to write")
    ask.add_argument("--config", default="config.yaml", type=Path, metavar="FILE", help="settings (config.yaml)")
    ask.add_argument("--results", type=Path, metavar="DIR", help="folder that make has filled; else beside them")
    ask.add_argument("--seed", type=_count, help="draw new questions, without truths; else those of the run, with them")
    ask.set_defaults(act="palpate.exchange.ask:ask")
    score = commands.add_parser("score", help="say how wrong an engine's answers to such questions are")
    score.add_argument("answers", type=Path, help="the file of answers (.npz or HDF5)")
    score.add_argument(
        "--questions", dest="folder", required=True, type=Path, metavar="DIR", help="folder that palpate ask wrote"
    )
    score.add_argument("--results", type=Path, metavar="DIR", help="folder that make has filled, to compare with")
    score.add_argument("--out", type=Path, metavar="DIR", help="folder for score.csv and score.png; else the answers'")
    score.add_argument("--own-law", action="store_true", help="find the truth of the engine's own law, too; minutes")
    score.set_defaults(act="palpate.exchange.score:score")
    return parser


def _add_data(command: argparse.ArgumentParser) -> argparse._MutuallyExclusiveGroup:
    """Add the arguments that describe a body's data; return the group of those that exclude ``--regions``."""
    command.add_argument("data", help="a mesh, a CT as one file, or a folder of DICOM slices")
    command.add_argument("mask", nargs="?", help="a mask of the CT")
    command.add_argument("--label", nargs="+", default=[], metavar="L", help="numbers or names of the mask's labels")
    parts = command.add_mutually_exclusive_group()
    parts.add_argument("--regions", action="store_true", help="the largest label is the body, the others its regions")
    command.add_argument(
        "--threshold", nargs=2, type=float, metavar=("LOW", "HIGH"), help="CT numbers of it [HU]; without a mask 30 120"
    )
    command.add_argument("--mri", action="store_true", help="the image is an MRI; --threshold is of its grey values")
    command.add_argument("--scale", type=_positive, metavar="M", help="length of a mesh file's unit [m]; else guessed")
    command.add_argument(
        "--hold", metavar="SIDE", help="what holds the body: below, above, left, right, front, back, or x-min to z-max"
    )
    command.add_argument("-o", "--folder", type=Path, help="where to write; else a folder beside the data")
    return parts


def _add_identify(command: argparse.ArgumentParser) -> None:
    command.add_argument("presses", type=Path, help="a CSV of presses: press, depth_m, force_n, and where they were")
    command.add_argument(
        "--instrument", required=True, metavar="sphere:RADIUS", help="the ball that pressed, such as sphere:4mm"
    )
    command.add_argument("--body", help="a mesh of the organ; or with --config the name of a body there")
    command.add_argument("--config", type=Path, metavar="FILE", help="settings that have the body")
    command.add_argument("--scale", type=_positive, metavar="M", help="length of the mesh's unit [m]; else guessed")
    command.add_argument("--hold", metavar="SIDE", help="what holds the mesh: below, above, …, as palpate init has it")
    command.add_argument(
        "--thickness", type=_lengths, metavar="LOW:HIGH",
        help="of a slab on something rigid, where no mesh is known, such as 20mm:40mm; without a unit metres",
    )  # fmt: skip
    command.add_argument("--poisson", type=_range, metavar="LOW:HIGH", help="range of ν (0.3:0.49)")
    command.add_argument("--sticking", type=_range, metavar="LOW:HIGH", help="friction: 0 slides, 1 sticks (0:1)")
    command.add_argument("--offset", type=_lengths, metavar="LOW:HIGH", help="of first touch; else by the depths")
    command.add_argument("--law", action="append", help="a law to compare; may be repeated")
    command.add_argument(
        "--column", action="append", default=[], metavar="NAME=COLUMN",
        help="the file's own name of a column, such as force_n=force_normal_n; may be repeated",
    )  # fmt: skip
    command.add_argument("-o", "--folder", type=Path, help="where to write; else a folder beside the presses")
    command.set_defaults(act=_identify)


def _identify(arguments: argparse.Namespace) -> str:
    from palpate.init.identify_command import Asked, body_of, identify_file

    if arguments.body is not None and arguments.thickness is not None:
        raise InputError("a slab of --thickness and a --body exclude each other; give one of them.")
    columns = dict(text.partition("=")[::2] for text in arguments.column)
    options = {
        "poisson": arguments.poisson, "sticking": arguments.sticking, "thickness_m": arguments.thickness,
        "offset_m": arguments.offset, "laws": arguments.law, "columns": columns,
    }  # fmt: skip
    settings = Asked(_instrument(arguments.instrument), **{k: v for k, v in options.items() if v is not None})
    make = partial(body_of, arguments.body, arguments.config, arguments.scale, arguments.hold)
    return identify_file(arguments.presses, settings, arguments.folder, make)


LENGTHS_M = {"": 1.0, "m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "μm": 1e-6, "nm": 1e-9}


def _length(text: str) -> float:
    """Return a length [m] that may have a unit, 4mm; ValueError for what is none."""
    match = re.fullmatch(r"\s*([-+.\d]+(?:[eE][-+]?\d+)?)\s*(\D*?)\s*", text)
    if not match or match[2].lower() not in LENGTHS_M:
        raise ValueError(text)
    return float(match[1]) * LENGTHS_M[match[2].lower()]


def _lengths(text: str) -> tuple[float, float]:
    return _range(text, _length)


def _range(text: str, number: Callable[[str], float] = float) -> tuple[float, float]:
    low, _, high = text.partition(":")
    try:
        ends = number(low), number(high or low)
    except ValueError:
        ends = math.nan, math.nan
    if not ends[0] <= ends[1]:
        raise argparse.ArgumentTypeError(f"{text} is no range; give LOW:HIGH, such as 0.02:0.04")
    return ends


def _init(arguments: argparse.Namespace) -> str:
    from palpate.init.command import init, init_each

    if arguments.each:
        return init_each(
            *_given(arguments), arguments.threshold, arguments.folder, arguments.mri, arguments.scale, arguments.hold
        )
    return init(_recognised(arguments), arguments.folder, arguments.hold)


def _try(arguments: argparse.Namespace) -> str:
    from palpate.init.command import program
    from palpate.init.try_command import try_body

    return try_body(_recognised(arguments), arguments.folder, arguments.hold, f"{program()} {shlex.join(sys.argv[1:])}")


def _recognised(asked: argparse.Namespace) -> "Data":
    from palpate.init.recognise import recognise

    return recognise(*_given(asked), asked.threshold, asked.regions, asked.mri, asked.scale)


def _given(arguments: argparse.Namespace) -> tuple[list[Path], list[int | str]]:
    """Return the data's paths, and labels; InputError for an unknown --hold, and a --threshold from high to low."""
    from palpate.init.recognise import HOLDS

    if arguments.hold not in (None, *HOLDS):
        raise InputError(f"--hold {arguments.hold} is no side; choose from {', '.join(HOLDS)}.")
    if arguments.threshold and not arguments.threshold[0] < arguments.threshold[1]:
        low, high = arguments.threshold
        raise InputError(f"--threshold is {low:g} {high:g}; give the lower number first.")
    paths = [Path(path) for path in (arguments.data, arguments.mask) if path is not None]
    return paths, [int(label) if label.isdecimal() else label for label in arguments.label]


def _port(text: str) -> int:
    if not text.isdecimal() or not 0 < int(text) < 65536:
        raise argparse.ArgumentTypeError(f"{text} is not a port; give a number from 1 to 65535")
    return int(text)


def _export(arguments: argparse.Namespace) -> str:
    from palpate.press.portable.command import export

    instruments = [_instrument(text) for text in arguments.instrument]
    return export(
        arguments.config,
        arguments.scene,
        arguments.model,
        arguments.contacts,
        arguments.out,
        instruments,
        arguments.places,
    )


def _instrument(text: str) -> "Instrument":
    from palpate.effects.instrument import Instrument

    kind, *lengths = text.split(":")
    try:
        radius, edge = (*map(_length, lengths), 0.0)[:2]
    except ValueError:
        raise InputError(f"--instrument {text} is none; give KIND:RADIUS, such as sphere:8mm.") from None
    return Instrument(kind, radius, edge)


def _count(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text} is not a whole number above 0")
    return int(text)


def _positive(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"{text} is not a number above 0")
    return value


def _share(text: str) -> float:
    value = _positive(text)
    if value >= 1:
        raise argparse.ArgumentTypeError(f"{text} is not a share below 1; 5 % is 0.05")
    return value


def _advise(arguments: argparse.Namespace) -> str:
    from palpate.report.advise import Asked, advise

    values = {"budgets_ms": arguments.budget_ms, "max_errors": arguments.max_error, "speeds": arguments.speed}
    limits = {name: [value] for name, value in values.items() if value is not None}
    if arguments.budget_ms is not None and arguments.speed is not None:
        raise InputError("a budget is for a step in real time; leave --budget-ms or --speed out.")
    if arguments.error == "force" and arguments.load is not None:
        raise InputError("--error force is of instruments that are pushed to a depth or moved; leave --load out.")
    scene = None if arguments.scene == "all" else arguments.scene
    return advise(Asked(Path(arguments.results), limits, arguments.error or "rms", arguments.load or ""), scene)


if __name__ == "__main__":
    sys.exit(main())
