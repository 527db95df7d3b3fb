"""Run snakemake for make: stop at Ctrl-C from the first moment on."""

import os
import shlex
import signal
import sys
from importlib.util import find_spec
from typing import Any, NoReturn

if "PALPATE_MAKE" in os.environ:  # what was typed, as a shell reads it
    goals, names = (os.environ.pop(f"PALPATE_{name}").split() for name in ("MAKE", "GIVEN"))
    given = [f"{name}={os.environ[name]}" for name in names]
    os.environ["PALPATE_COMMAND"] = shlex.join(["make", *goals, *given])


def stop(*_: Any) -> NoReturn:
    """End before there is anything to clean up."""
    leave(f"stopped; type {os.environ.get('PALPATE_COMMAND', 'make')} to go on")


def leave(status: str | int) -> NoReturn:
    """End with an exit status, or with a sentence and status 1."""
    if isinstance(status, str):
        print(status, file=sys.stderr, flush=True)
        status = 1
    sys.stdout.flush()
    os._exit(status)


for number in (signal.SIGINT, signal.SIGTERM):
    signal.signal(number, stop)
module, *arguments = sys.argv[1:]
missing = [name for name in ("palpate", "snakemake") if not find_spec(name)]
if missing:
    leave(f"error: the environment lacks {' and '.join(missing)}; type make distclean, and then make.")
try:
    if module == "snakemake":
        from snakemake.cli import main

        main(arguments)
    else:
        from palpate.run.leftovers import main

        leave(main(arguments))
except SystemExit as ended:
    leave(ended.code or 0)
