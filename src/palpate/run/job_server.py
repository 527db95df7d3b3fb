"""Start jobs without importing libraries anew: a process that has them in memory forks one process for each job.

Imports are most of what a short job costs. The server imports nothing of palpate's but how numba stores what it
compiles, so that a job still pays only for what it calls for. workflow/start_job.py sends the requests; without a
server it runs the script itself.
"""

import json
import os
import selectors
import signal
import socket
import subprocess
import sys
from collections.abc import Mapping
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

LIBRARIES = (
    "scipy.sparse.linalg",
    "pandas",
    "h5py",
    "matplotlib.pyplot",
    "snakemake.iocontainers",
    "snakemake.logging",
)
MAX_REQUEST_BYTES = 1 << 20
"""Bytes that a request may have."""


class Job(NamedTuple):
    """A request: a Python file, the folder to run it in, and the environment variables."""

    script: str
    folder: str
    environment: dict[str, str]


class Running(NamedTuple):
    """A forked process: its number, the descriptor that is readable when it has ended, and the client's connection."""

    process: int
    end_fd: int
    client: socket.socket


def start(python: str, place: str, environment: Mapping[str, str]) -> subprocess.Popen | None:
    """Start a server with the interpreter ``python`` at the socket ``place``, as a child of this process.

    environment : of jobs, beside that of this process
    Returns None, and starts nothing, where no descriptor reports the end of a process (before Linux 5.3).
    """
    if not hasattr(os, "pidfd_open"):
        return None
    command = [python, "-m", "palpate.run.job_server", place, str(os.getpid())]
    return subprocess.Popen(command, env={**os.environ, **environment}, stdin=subprocess.DEVNULL)


def serve(place: str, run: int) -> Job | None:
    """Start a process for each request until the process ``run``, which started this one, has gone.

    Returns the job in each forked process, and None in the server when it is done.
    """
    events, listener = selectors.DefaultSelector(), socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    Path(place).unlink(missing_ok=True)
    listener.bind(place)
    os.chmod(place, 0o600)  # whoever may write to it runs code as this user
    listener.listen()  # requests wait while libraries are imported
    events.register(listener, selectors.EVENT_READ)
    _import()
    while os.getppid() == run:
        for key, _ in events.select(timeout=1):
            if key.data is None:
                if job := _fork(listener, events):
                    return job
            elif key.fileobj in events.get_map():
                _follow(key.fileobj, key.data, events)
    Path(place).unlink(missing_ok=True)
    return None


def _import() -> None:
    """Import what most jobs do, and what numba imports when it is first used."""
    for name in LIBRARIES:
        with suppress(ImportError):  # a job that needs it will say so
            import_module(name)
    with suppress(ImportError):
        import_module("numba").njit(lambda value: value + 1.0)(0.0)


def _fork(listener: socket.socket, events: selectors.BaseSelector) -> Job | None:
    """Take a request and fork; return the job in the new process, whose streams are those of the client."""
    client, _ = listener.accept()
    message, streams, _, _ = socket.recv_fds(client, MAX_REQUEST_BYTES, 3)
    process = os.fork() if len(streams) == 3 else -1
    if not process:
        for number, stream in enumerate(streams):
            os.dup2(stream, number)
        inherited: list[Any] = [key.fileobj for key in events.get_map().values()]
        events.close()
        for one in (client, *inherited, *streams):
            one.close() if isinstance(one, socket.socket) else os.close(one)
        return Job(*json.loads(message))
    for stream in streams:
        os.close(stream)
    if process > 0:
        running = Running(process, os.pidfd_open(process), client)
        for source in (running.end_fd, client):
            events.register(source, selectors.EVENT_READ, running)
    return None


def _follow(source: Any, running: Running, events: selectors.BaseSelector) -> None:
    """Report the end of a process to its client, or kill the process if its client has gone.

    source : what has become readable, one of ``running.end_fd`` and ``running.client``
    """
    events.unregister(source)
    if source is running.client:
        os.kill(running.process, signal.SIGKILL)
        return
    _, status = os.waitpid(running.process, 0)
    with suppress(OSError):
        running.client.send(str(os.waitstatus_to_exitcode(status)).encode())
    with suppress(KeyError):  # a client that has gone is no longer registered
        events.unregister(running.client)
    running.client.close()
    os.close(running.end_fd)


def run(job: Job) -> None:
    """Run a script in this process as the interpreter would."""
    os.chdir(job.folder)
    os.environ.clear()
    os.environ.update(job.environment)
    sys.argv, sys.path[0] = [job.script], str(Path(job.script).parent)
    main = sys.modules["__main__"] = ModuleType("__main__")
    main.__file__ = job.script
    exec(compile(Path(job.script).read_bytes(), job.script, "exec"), main.__dict__)


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the run ends its jobs, as a shell's trap does elsewhere
    if job := serve(sys.argv[1], int(sys.argv[2])):
        run(job)
