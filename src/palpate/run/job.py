"""The frame of every script: a log with its warnings, one sentence on failure, no process left after its run."""

import math
import os
import sys
import threading
import time
import traceback
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from importlib import import_module
from inspect import signature
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, TextIO

from palpate.errors import InputError, NotConverged
from palpate.files import write_whole
from palpate.run.system_faults import of_error

if TYPE_CHECKING:
    import pandas as pd

WARNED = "warning: "
"""How a warning begins in a job's log."""


def warnings_in_logs(logs: Iterable[str | Path]) -> list[str]:
    """Return the warnings in the logs of jobs, each once; a log that is missing has none."""
    lines = [
        line.removeprefix(WARNED)
        for log in map(Path, logs)
        if log.is_file()
        for line in log.read_text(encoding="utf-8", errors="replace").splitlines()
        if line.startswith(WARNED)
    ]
    return list(dict.fromkeys(lines))


def save_warnings(lines: Iterable[str], path: str | Path) -> None:
    """Write warnings to a file, one a line and each once; it is empty if there are none."""
    with write_whole(path) as part:
        part.write_text("".join(f"{line}\n" for line in dict.fromkeys(lines)), encoding="utf-8")


def load_warnings(paths: Iterable[str | Path]) -> list[str]:
    """Read the warnings in files of ``save_warnings``, each once."""
    return list(dict.fromkeys(line for path in paths for line in Path(path).read_text(encoding="utf-8").splitlines()))


FAILED = "error: "
"""How the one sentence of a failed job begins in its log."""


@contextmanager
def job(log: str, warned: str | None = None) -> Iterator[Callable[[str], None]]:
    """Run the body of a workflow script; yields ``say``, which writes a line to the terminal and to ``log``.

    warned : the output that gets the warnings, for the report
    A failure ends the process with exit code 1 and one sentence; the traceback of an unforeseen one goes to
    the log only.
    """
    start, run = time.perf_counter(), int(os.environ.get("PALPATE_RUN", "0"))
    _end_with(run)
    with _opened(log) as file:

        def say(line: str) -> None:
            print(line, file=sys.stderr, flush=True)
            _write(line, file)

        def fail(sentence: str) -> NoReturn:
            # a run prints the sentence itself, when nothing can come after it any more
            if not _write(f"{FAILED}{sentence}", file) or not run:
                print(f"{FAILED}{sentence}", file=sys.stderr, flush=True)
            if run:
                os._exit(1)  # at its usual end HDF5 crashes over what it could not write
            raise SystemExit(1) from None

        if run:  # and before that it reports at length
            sys.unraisablehook = lambda event: _write(f"ignored: {event.exc_value}", file) and None
            sys.excepthook = lambda kind, error, _: _write(f"ignored: {kind.__name__}: {error}", file) and None
        try:
            with _warnings_to(say) as kept:
                yield say
            if warned is not None:
                save_warnings(kept, warned)
        except (InputError, NotConverged) as error:
            fail(str(error))
        except (Exception, SystemExit) as error:  # a file of the user's may call sys.exit
            from palpate.own_file import own_fault

            _write(traceback.format_exc(), file)
            if sentence := of_error(error, Path(log).parent) or own_fault(error):
                fail(sentence)
            fail(f"{type(error).__name__}: {error} (a fault of palpate's; the traceback is in {log})")
        else:
            _write(f"took {time.perf_counter() - start:.1f} s, {time.process_time():.1f} s of a core", file)


def call(snakemake: Any) -> None:
    """Run the function that a rule names, with those of snakemake's input, output, params, ... that it names.

    Its tables are written: one to the first output, several to those with their names.
    """
    with job(snakemake.log[0], snakemake.output.get("warned")) as say:
        module, _, name = snakemake.params.call.partition(":")
        function = getattr(import_module(module), name)
        wanted = signature(function).parameters
        found = function(**{key: say if key == "say" else getattr(snakemake, key) for key in wanted})
        if found is not None:
            tables = found if isinstance(found, dict) else {0: found}
            for key, table in tables.items():
                write_table(table, snakemake.output[key])


@contextmanager
def _opened(log: str) -> Iterator[TextIO | None]:
    """Open a log, or give None where a full or read-only disk has no room for it."""
    with ExitStack() as stack:
        file = None
        with suppress(OSError):
            Path(log).parent.mkdir(parents=True, exist_ok=True)
            file = stack.enter_context(open(log, "w", buffering=1, encoding="utf-8"))
        yield file


def _write(text: str, file: TextIO | None) -> bool:
    """Write a line to a log; False if that cannot be done."""
    try:
        if file:
            print(text, file=file)
    except (OSError, ValueError):  # ValueError: it is closed
        return False
    return file is not None


@contextmanager
def _warnings_to(say: Callable[[str], None]) -> Iterator[list[str]]:
    """Print warnings of palpate, which puts them into the log; those of other packages go where they went.

    Yields the list that those of palpate are added to.
    """
    with warnings.catch_warnings():
        others, kept = warnings.showwarning, []

        def show(message: Warning | str, category: type[Warning], *where: Any, **more: Any) -> None:
            if category is UserWarning:
                kept.append(" ".join(str(message).split()))
                say(f"{WARNED}{kept[-1]}")
            else:
                others(message, category, *where, **more)

        warnings.showwarning = show
        yield kept


def _end_with(run: int) -> None:
    """End this process soon after the process ``run`` has gone; 0 is nobody.

    Trap: a killed snakemake leaves its jobs behind, on cores that the next run would share with them.
    """
    if not run:
        return

    def watch() -> None:
        while os.path.exists(f"/proc/{run}") or not os.path.exists("/proc"):
            time.sleep(1)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def use_threads(count: int) -> None:
    """Set numba to run on ``count`` threads; before anything is imported that needs it.

    Numba reads their number when it is imported. In a process that has it already, the script begins anew.
    """
    known, os.environ["NUMBA_NUM_THREADS"] = os.environ.get("NUMBA_NUM_THREADS"), str(count)
    if known != str(count) and "numba" in sys.modules:
        os.execv(sys.executable, [sys.executable, *sys.argv])


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
        said = -math.inf
        for number, item in enumerate(sequence, start=1):
            if time.monotonic() - said >= 5 or number == len(sequence):
                said = time.monotonic()
                say(f"{what} {number} of {len(sequence)}")
            yield item

    return wrapped


def rarely(say: Callable[[str], None], what: str) -> Callable[..., None]:
    """Return a function that prints ``what`` and the numbers it is called with, at most every five seconds."""
    said = -math.inf

    def tell(*values: float) -> None:
        nonlocal said
        if time.monotonic() - said >= 5:
            said = time.monotonic()
            say(f"{what} {', '.join(f'{value:g}' for value in values)}")

    return tell


def powers(exponents: Mapping[str, float]) -> str:
    """Return with which power of the size each quantity grows, for a line of progress; without those not known."""
    return ", ".join(f"{name} n^{power:.2f}" for name, power in exponents.items() if math.isfinite(power))


def stem(outputs: Sequence[str]) -> Path:
    """Return the path of a figure's files without their suffixes."""
    return Path(outputs[0]).with_suffix("")
