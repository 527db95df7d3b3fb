"""Run a Python script in a process that palpate's job server forks, or, where there is none, as python does.

Its interpreter is started without site-packages, so only the standard library may be imported here.
"""

import json
import os
import signal
import socket
import sys


def main() -> None:
    """Ask the server, wait, and end as the script has ended."""
    asked = sys.argv[1:]
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as server:
        try:
            if len(asked) != 1:  # options: snakemake starts itself, too
                raise OSError
            server.connect(os.environ["PALPATE_JOBS"])
            message = json.dumps([*asked, os.getcwd(), dict(os.environ)]).encode()
            socket.send_fds(server, [message], [0, 1, 2])
        except (OSError, KeyError):
            os.execv(sys.executable, [sys.executable, *asked])
        answer = server.recv(64)
    status = int(answer) if answer else -signal.SIGKILL  # no answer: the server has been killed
    if status < 0:
        signal.signal(-status, signal.SIG_DFL) if -status not in (signal.SIGKILL, signal.SIGSTOP) else None
        os.kill(os.getpid(), -status)
    sys.exit(status)


main()
