"""Serve one page and its answers to this machine only, to whoever knows the token; anything else gets a 4xx.

Trap: any page that a browser shows can send requests to 127.0.0.1, under a name of its own, too. So the address holds
a token, the Host must be this machine's, and presses must be JSON, which other pages may not post.
"""

import secrets
import socket
import threading
from collections.abc import Callable
from contextlib import suppress
from hmac import compare_digest
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from socketserver import TCPServer
from typing import Any

from palpate.errors import InputError, NotConverged

HOST = "127.0.0.1"
LARGEST = 8192
"""Bytes of a body; two presses have 300."""
PATIENCE_S = 10.0
"""Time within which a whole request must have come."""
LINGER_S = 0.5
"""Time for which the rest of a refused request is waited for."""
CLIENTS = 16
"""Requests at once; more are turned away. A browser opens six connections."""
_HEADERS = {
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",  # the address holds the token
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Cross-Origin-Resource-Policy": "same-origin",
}

Answer = Callable[[str, bytes], bytes]
"""Return JSON for the name of a model and the body of a request; InputError or NotConverged says why there is none."""


class PressServer(ThreadingHTTPServer):
    """A server of ``page`` and of answers, on ``port`` of this machine, or on any that is free if it is 0.

    token : random, part of every address
    Raises InputError if the port cannot be had. Nothing is written to disk, and no request is logged.
    """

    daemon_threads = True
    block_on_close = False
    allow_reuse_address = True

    def __init__(self, page: str, names: list[str], answer: Answer, port: int = 0):
        self.page, self.names, self.answer = page.encode(), names, answer
        self.token = secrets.token_urlsafe(24)
        self._places = threading.BoundedSemaphore(CLIENTS)
        try:
            super().__init__((HOST, port), _Handler)
        except (OSError, OverflowError) as error:
            raise InputError(f"port {port} cannot be had ({error}); give another one with --port.") from None

    @property
    def hosts(self) -> tuple[str, str]:
        """The names under which a browser may ask for this server."""
        return f"{HOST}:{self.server_port}", f"localhost:{self.server_port}"

    @property
    def address(self) -> str:
        """The address of the page."""
        return f"http://{self.hosts[0]}/{self.token}/"

    def server_bind(self) -> None:
        """Take the port without asking a name server for this machine's name, as the library does."""
        TCPServer.server_bind(self)
        self.server_name, self.server_port = HOST, self.server_address[1]

    def process_request(self, request: Any, client_address: Any) -> None:
        """Handle a request in a thread, unless there are CLIENTS."""
        if self._places.acquire(blocking=False):
            super().process_request(request, client_address)
        else:
            self.shutdown_request(request)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        """Handle a request, and make room for another."""
        try:
            super().process_request_thread(request, client_address)
        finally:
            self._places.release()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Ignore clients that go away in the middle of a request."""


class _Handler(BaseHTTPRequestHandler):
    """One request and its answer; the connection is closed after it."""

    server: PressServer
    timeout = PATIENCE_S

    def setup(self) -> None:
        """Begin to count the time that the client has for its whole request."""
        super().setup()
        self._alarm = threading.Timer(PATIENCE_S, self._hang_up)
        self._alarm.daemon = True
        self._alarm.start()

    def finish(self) -> None:
        """Stop counting."""
        self._alarm.cancel()
        with suppress(OSError):
            super().finish()

    def do_GET(self) -> None:
        """Send the page."""
        if self._may_ask():
            if self._is("/"):
                self._send(HTTPStatus.OK, self.server.page, "text/html; charset=utf-8")
            else:
                self._refuse(HTTPStatus.NOT_FOUND, "there is nothing here.")

    def do_POST(self) -> None:
        """Send the answer of a model to presses."""
        if not self._may_ask():
            return
        name = next((name for name in self.server.names if self._is(f"/answer/{name}")), None)
        if name is None:
            self._refuse(HTTPStatus.NOT_FOUND, "there is nothing here.")
        elif self.headers.get("Content-Type", "").partition(";")[0].strip().lower() != "application/json":
            self._refuse(HTTPStatus.UNSUPPORTED_MEDIA_TYPE, "post presses as application/json.")
        elif (body := self._body()) is not None:
            self._answer(name, body)

    def send_error(self, code: int, message: str | None = None, explain: str | None = None) -> None:
        """Refuse what the library cannot read; an unknown method or version is the client's fault, too."""
        wrong = HTTPStatus.METHOD_NOT_ALLOWED if code == HTTPStatus.NOT_IMPLEMENTED else HTTPStatus.BAD_REQUEST
        self._refuse(HTTPStatus(code) if 400 <= code < 500 else wrong, "this request is not understood.")

    def version_string(self) -> str:
        """Return how the server names itself, without versions."""
        return "palpate"

    def log_message(self, format: str, *args: Any) -> None:
        """Log nothing."""

    def _answer(self, name: str, body: bytes) -> None:
        try:
            found = self.server.answer(name, body)
        except InputError as error:
            self._refuse(HTTPStatus.BAD_REQUEST, str(error))
        except NotConverged as error:
            self._refuse(HTTPStatus.UNPROCESSABLE_ENTITY, f"{error}.")
        else:
            self._send(HTTPStatus.OK, found, "application/json")

    def _may_ask(self) -> bool:
        """Return whether the request is for this machine; refuse it if not."""
        hosts = self.headers.get_all("Host", [])
        origin = self.headers.get("Origin")
        own = len(hosts) == 1 and hosts[0] in self.server.hosts
        if not own or origin not in (None, f"http://{hosts[0]}"):
            self._refuse(HTTPStatus.FORBIDDEN, "this address is not served.")
            return False
        return True

    def _is(self, path: str) -> bool:
        """Return whether the request is for a path behind the token; compared in a time that tells nothing of it."""
        return compare_digest(self.path.encode("utf-8", "replace"), f"/{self.server.token}{path}".encode())

    def _body(self) -> bytes | None:
        """Read the body; None if it is refused."""
        lengths = self.headers.get_all("Content-Length", [])
        if len(lengths) != 1 or "Transfer-Encoding" in self.headers:
            self._refuse(HTTPStatus.LENGTH_REQUIRED, "say once how long the body is.")
        elif not (lengths[0].isascii() and lengths[0].isdigit()):
            self._refuse(HTTPStatus.BAD_REQUEST, "the length of the body is no number.")
        elif len(lengths[0]) > 9 or int(lengths[0]) > LARGEST:
            self._refuse(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, f"a body has {LARGEST} bytes at most.")
        else:
            body = self.rfile.read(int(lengths[0]))
            if len(body) == int(lengths[0]):
                return body
            self._refuse(HTTPStatus.BAD_REQUEST, "the body is shorter than it was said to be.")
        return None

    def _refuse(self, status: HTTPStatus, sentence: str) -> None:
        self.close_connection = True
        self._send(status, f"{sentence}\n".encode(), "text/plain; charset=utf-8")
        with suppress(OSError):  # a connection that is closed before all was read is torn down, with what was sent
            self.connection.shutdown(socket.SHUT_WR)
            self.connection.settimeout(LINGER_S)
            for _ in range(LARGEST // 1024):
                if not self.connection.recv(1024):
                    break

    def _send(self, status: HTTPStatus, content: bytes, kind: str) -> None:
        self._alarm.cancel()
        self.send_response(status)
        for name, value in (_HEADERS | {"Content-Type": kind, "Content-Length": str(len(content))}).items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(content)

    def _hang_up(self) -> None:
        with suppress(OSError):
            self.connection.shutdown(socket.SHUT_RD)
