"""The frame of every job: a log with its warnings, one sentence on failure, tables that are written whole."""

import math
import os
import sys
import time
import traceback
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.errors import InputError, NotConverged
from palpate.files import save_warnings, write_whole

if TYPE_CHECKING:
    import pandas as pd


@contextmanager
def job(log: str | Path, warned: str | None = None) -> Iterator[Callable[[str], None]]:
    """Run the body of a workflow script; yields ``say``, which writes a line to the terminal and to ``log``.

    warned : the output that gets the warnings, for the report
    A failure ends the process with exit code 1; one sentence is the last line of the log, which snakemake shows.
    The traceback of what was not foreseen stands before it.
    """
    start = time.perf_counter()
    Path(log).parent.mkdir(parents=True, exist_ok=True)
    with open(log, "w", buffering=1, encoding="utf-8") as file:

        def say(line: str) -> None:
            print(line, file=sys.stderr, flush=True)
            print(line, file=file)

        try:
            with _warnings_to(say) as messages:
                yield say
            if warned is not None:
                save_warnings(messages, warned)
        except (InputError, NotConverged) as error:
            print(f"error: {error}", file=file)
            raise SystemExit(1) from None
        except (Exception, SystemExit) as error:  # a file of the user's may call sys.exit
            from palpate.own_file import own_fault

            print(traceback.format_exc(), file=file)
            print(f"error: {own_fault(error) or f'{type(error).__name__}: {error}'}", file=file)
            raise SystemExit(1) from None
        else:
            print(f"took {time.perf_counter() - start:.1f} s, {time.process_time():.1f} s of a core", file=file)


@contextmanager
def _warnings_to(say: Callable[[str], None]) -> Iterator[list[str]]:
    """Say palpate's warnings, and yield the list that they are added to; those of other packages go where they went."""
    with warnings.catch_warnings():
        show_others, ours = warnings.showwarning, []

        def show(message: Warning | str, category: type[Warning], *where: Any, **more: Any) -> None:
            if category is UserWarning:
                ours.append(" ".join(str(message).split()))
                say(f"warning: {ours[-1]}")
            else:
                show_others(message, category, *where, **more)

        warnings.showwarning = show
        yield ours


def kernel_cache() -> Path:
    """Return the folder of compiled functions, beside the modules or, if these are read-only, in .snakemake."""
    package = Path(__file__).parents[1]
    place = package / "__pycache__" if os.access(package, os.W_OK) else Path(".snakemake").absolute()
    return place / "kernels"


def write_table(table: "pd.DataFrame", path: str) -> None:
    """Write a data frame as CSV, whole or not at all."""
    with write_whole(path) as temporary:
        table.to_csv(temporary, index=False)


def steps(say: Callable[[str], None], what: str) -> Callable[[Sequence], Iterator]:
    """Wrap a sequence, as ``tqdm`` does, and say at most every five seconds how far it has come."""

    def wrapped(sequence: Sequence) -> Iterator:
        last_said = -math.inf
        for number, item in enumerate(sequence, start=1):
            if time.monotonic() - last_said >= 5 or number == len(sequence):
                last_said = time.monotonic()
                say(f"{what} {number} of {len(sequence)}")
            yield item

    return wrapped


def rarely(say: Callable[[str], None], what: str) -> Callable[..., None]:
    """Return a function that prints ``what`` and the numbers it is called with, at most every five seconds."""
    last_said = -math.inf

    def tell(*values: float) -> None:
        nonlocal last_said
        if time.monotonic() - last_said >= 5:
            last_said = time.monotonic()
            say(f"{what} {', '.join(f'{value:g}' for value in values)}")

    return tell


def powers(exponents: Mapping[str, float]) -> str:
    """Return with which power of the size each quantity grows, for a line of progress; without those not known."""
    return ", ".join(f"{name} n^{power:.2f}" for name, power in exponents.items() if math.isfinite(power))


def free_mb() -> float:
    """Return the free memory [MB] of the machine, or of this process's control group where that is less."""
    import psutil

    free, cgroup = psutil.virtual_memory().available / 1e6, Path("/sys/fs/cgroup")
    with suppress(OSError, ValueError):
        limit, used = (float((cgroup / name).read_text()) for name in ("memory.max", "memory.current"))
        free = min(free, (limit - used) / 1e6)
    return free


def stem(outputs: Sequence[str]) -> Path:
    """Return the path of a figure's files without their suffixes."""
    return Path(outputs[0]).with_suffix("")
