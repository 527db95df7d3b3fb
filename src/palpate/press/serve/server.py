"""Serve one page and its answers to this machine only, to whoever knows the token; anything else gets a 4xx."""

import secrets
import socket
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from http.server import ThreadingHTTPServer
from socketserver import TCPServer
from typing import Any

from palpate.errors import InputError
from palpate.press.serve.handler import Handler

HOST = "127.0.0.1"
CLIENTS = 16
"""Requests that are waited for at once; a browser opens six connections to a tab, some of which stay silent."""

Answer = Callable[[str, bytes], bytes]
"""Return JSON for the name of a model and the body of a request; InputError or NotConverged says why there is none."""


class PressServer(ThreadingHTTPServer):
    """A server of a page and of answers, on ``port`` of this machine, or on any that is free if it is 0.

    The port is taken at once; ``offer`` says what is served. token : random, part of every address
    Raises InputError if the port cannot be had. Nothing is written to disk, and no request is logged.
    """

    daemon_threads = True
    block_on_close = False
    allow_reuse_address = True
    request_queue_size = 2 * CLIENTS

    page: bytes
    names: list[str]
    answer: Answer

    def __init__(self, port: int = 0):
        self.token = secrets.token_urlsafe(24)
        self.turn = threading.Lock()  # models keep what they reuse between answers
        self._waited_for: dict[Any, None] = {}  # connections, the first of which came first
        self._counting = threading.Lock()
        try:
            super().__init__((HOST, port), Handler)
        except (OSError, OverflowError) as error:
            raise InputError(f"port {port} cannot be had ({error}); give another one with --port.") from None

    def offer(self, page: str, names: list[str], answer: Answer) -> None:
        """Serve ``page``, and the answers of models by their names."""
        self.page, self.names, self.answer = page.encode(), names, answer

    @property
    def hosts(self) -> tuple[str, str]:
        """The names under which a browser may ask for this server."""
        port = "" if self.server_port == 80 else f":{self.server_port}"  # browsers leave this one out
        return f"{HOST}{port}", f"localhost{port}"

    @property
    def address(self) -> str:
        """The address of the page."""
        return f"http://{self.hosts[0]}/{self.token}/"

    def server_bind(self) -> None:
        """Take the port without asking a name server for this machine's name, as the library does."""
        TCPServer.server_bind(self)
        self.server_name, self.server_port = HOST, self.server_address[1]

    def process_request(self, request: Any, client_address: Any) -> None:
        """Handle a request in a thread; of CLIENTS that are waited for, the one that came first makes room."""
        with self._counting:
            first = next(iter(self._waited_for)) if len(self._waited_for) >= CLIENTS else None
            self._waited_for.pop(first, None)
            self._waited_for[request] = None
        if first is not None:
            with suppress(OSError):  # it may have ended by itself
                first.shutdown(socket.SHUT_RDWR)
        super().process_request(request, client_address)

    def has_come(self, request: Any) -> None:
        """Wait for a request no longer, so that it need not make room."""
        with self._counting:
            self._waited_for.pop(request, None)

    def shutdown_request(self, request: Any) -> None:
        """End a request, however it went."""
        self.has_come(request)
        super().shutdown_request(request)

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Ignore clients that go away in the middle of a request, and nothing else."""
        if not isinstance(sys.exception(), OSError):
            super().handle_error(request, client_address)
