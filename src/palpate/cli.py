"""The command ``palpate``: a first config for your own data, and advice from the tables of a run."""

import argparse
import math
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from palpate.errors import InputError

if TYPE_CHECKING:
    import pandas as pd


class _Parser(argparse.ArgumentParser):
    """Says what is wrong in one sentence, like all of palpate."""

    def error(self, message: str) -> NoReturn:
        raise InputError(f"{self.prog}: {message}; see {self.prog} --help.")


def main(arguments: list[str] | None = None) -> int:
    """Run the command; 0, or 1 with one sentence on standard error if something given cannot be used."""
    try:
        asked = _parser().parse_args(arguments)
        print(asked.act(asked), flush=True)
    except BrokenPipeError:  # whoever reads has had enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except KeyboardInterrupt:
        print("stopped", file=sys.stderr)
        return 130
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(prog="palpate", description=__doc__)
    commands = parser.add_subparsers(required=True, metavar="command")
    init = commands.add_parser("init", help="write a config.yaml for a mesh, or for a CT and perhaps its mask")
    init.add_argument("data", help="a mesh, a CT as one file, or a folder of DICOM slices")
    init.add_argument("mask", nargs="?", help="a mask of the CT")
    init.add_argument("--label", nargs="+", default=[], metavar="L", help="numbers or names of the mask's labels")
    parts = init.add_mutually_exclusive_group()
    parts.add_argument("--each", action="store_true", help="a config for each label, not one body of all")
    parts.add_argument("--regions", action="store_true", help="the largest label is the body, the others its regions")
    init.add_argument("--threshold", nargs=2, type=float, metavar=("LOW", "HIGH"), help="CT numbers of the organ [HU]")
    init.add_argument("--mri", action="store_true", help="the image is an MRI; --threshold is of its grey values")
    init.add_argument("-o", "--folder", type=Path, help="where to write; else a folder beside the data")
    init.set_defaults(act=_init)
    advise = commands.add_parser("advise", help="which model to take, its error, and its time")
    advise.add_argument("--scene", help="a body and a regime of loads, such as liver_small, or one that moves; or all")
    limit = advise.add_mutually_exclusive_group()
    limit.add_argument(
        "--budget-ms", type=_positive, help="time for one answer, or one step [ms]: 16.7 for 60 pictures a second"
    )
    limit.add_argument("--max-error", type=_share, help="largest mean error, as a share of the peak displacement")
    advise.add_argument(
        "--error", choices=["rms", "patch"], default="rms", help="over the whole surface (rms), or where it is pressed"
    )
    advise.add_argument(
        "--load", choices=["prepared", "never-prepared", "two-contacts", "depth", "all"],
        help="another kind of load: a place never prepared, two contacts at once, a disc pushed to a depth; or all",
    )  # fmt: skip
    advise.add_argument("--results", default="results", metavar="DIR", help="folder that make has filled (results)")
    advise.set_defaults(act=_advise)
    return parser


def _init(asked: argparse.Namespace) -> str:
    from palpate.init.command import init, init_each

    paths = [Path(path) for path in (asked.data, asked.mask) if path is not None]
    label = [int(label) if label.isdecimal() else label for label in asked.label]
    if asked.each:
        return init_each(paths, label, asked.folder, asked.mri)
    return init(paths, label, asked.threshold, asked.folder, asked.regions, asked.mri)


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


def _advise(asked: argparse.Namespace) -> str:
    """Advise for one scene or for all; without a limit, what the run was asked for."""
    from palpate.figures import tables

    results = Path(asked.results)
    if asked.load is not None:
        return _advise_any_load(asked, results)
    pressed, moving, listed = (
        results / "tables" / f"{name}.csv" for name in ("accuracy_vs_time", "dynamic_accuracy", "advice")
    )
    free = asked.budget_ms is None and asked.max_error is None
    paths = [listed] if free else [path for path in (pressed, moving) if path.is_file()] or [pressed]
    found = [tables.read(path) for path in paths]
    known = [name for table in found for name in tables.scenes(table)]
    if asked.scene is not None and asked.scene not in known:
        raise InputError(f"--scene {asked.scene} is not in {results}; choose from {', '.join(known)}.")
    chosen = known if asked.scene is None else [asked.scene]
    if free:
        from palpate.report.advice_list import advice_list

        return advice_list(found[0][found[0]["scene"].isin(chosen)], asked.error)
    limits = {"budgets_ms": [asked.budget_ms]} if asked.max_error is None else {"max_errors": [asked.max_error]}
    return "\n".join(_advise_scene(results, name, found, limits, asked.error) for name in chosen)


def _advise_any_load(asked: argparse.Namespace, results: Path) -> str:
    """Advise for one kind of load or all, in one scene of any_load.csv or all."""
    from palpate.evaluation.tradeoff.advice_any_load import advise_any_load
    from palpate.evaluation.tradeoff.general_loads import KINDS
    from palpate.figures import tables
    from palpate.report.any_load_words import lines

    table = tables.read(results / "tables/any_load.csv")
    if asked.scene is not None and asked.scene not in tables.scenes(table):
        raise InputError(
            f"--scene {asked.scene} is not in any_load.csv; choose from {', '.join(tables.scenes(table))}."
        )
    kinds = [kind for kind in KINDS if asked.load in ("all", kind.replace(" ", "-"))]
    return "\n".join(
        lines(advise_any_load(tables.where(table, scene=scene), kind, asked.budget_ms, asked.max_error, asked.error))
        for scene in tables.scenes(table)
        if asked.scene in (None, scene)
        for kind in kinds
    )


def _advise_scene(results: Path, scene: str, found: list["pd.DataFrame"], limits: dict, kind: str) -> str:
    """Advise for one scene of accuracy_vs_time.csv, by its first split, or of dynamic_accuracy.csv if it moves."""
    from palpate.evaluation.tradeoff.advice import advise
    from palpate.evaluation.tradeoff.advice_agreement import same_in
    from palpate.evaluation.tradeoff.advice_motion import advise_motion
    from palpate.evaluation.tradeoff.bootstrap import read_errors
    from palpate.figures import tables
    from palpate.report.advice_words import lines

    table = next(table for table in found if scene in tables.scenes(table))
    rows = tables.where(table, scene=scene)
    if "regime" not in table:
        if kind != "rms":
            return f"{scene}: a scene that moves has no patch; leave --error {kind} out"
        return lines(advise_motion(rows, **limits).iloc[0], rows)
    advised = advise(rows, read_errors(results / "data", rows), **limits, kinds=[kind])
    same, splits = same_in(advised)
    agreed = f"the same model in {same} of {splits} splits of the contacts" if splits > 1 else ""
    return lines(advised.iloc[0], tables.where(rows, split=advised["split"].iloc[0]), agreed)
