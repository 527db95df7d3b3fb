"""Serve one page and its answers to this machine only, to whoever knows the token.

Trap: any page that a browser shows can send requests to 127.0.0.1, under a name of its own, too. So the address holds
a token, the Host must be this machine's, and presses must be JSON, which other pages may not post.
"""

import ctypes
import secrets
import sys
import threading
import traceback
from collections.abc import Callable, Mapping
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from socketserver import TCPServer
from typing import Any

from palpate.errors import InputError, NotConverged

HOST = "127.0.0.1"
MAX_BYTES = 8192
"""Bytes of a body; two presses have 300."""
_HEADERS = {"Cache-Control": "no-store", "Referrer-Policy": "no-referrer", "X-Frame-Options": "DENY"}
"""Of every answer: the page's address holds the token."""

Answer = Callable[[bytes], bytes]
"""Return JSON for the body of a request; InputError or NotConverged says why there is none."""


class PressServer(ThreadingHTTPServer):
    """A server of a page and of answers, on ``port`` of this machine, or on any that is free if it is 0.

    The port is taken at once; ``offer`` says what is served. token : random, part of every address
    Raises InputError if the port cannot be had. Nothing is written to disk, and no request is logged.
    """

    daemon_threads = True
    block_on_close = False

    page: bytes
    answers: Mapping[str, Answer]

    def __init__(self, port: int = 0):
        self.token = secrets.token_urlsafe(24)
        self.turn = threading.Lock()  # models keep what they reuse between answers
        self.answering: int | None = None  # the thread whose turn it is
        try:
            super().__init__((HOST, port), Handler)
        except (OSError, OverflowError) as error:
            raise InputError(f"port {port} cannot be had ({error}); give another one with --port.") from None

    def offer(self, page: str, answers: Mapping[str, Answer]) -> None:
        """Serve ``page``, and ``answers`` by their addresses below the page's, such as answer/fem_p1."""
        self.page, self.answers = page.encode(), answers

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

    def server_close(self) -> None:
        """Close the port and cancel the answer under way: Python cannot end while another thread compiles or solves."""
        super().server_close()
        # the exception may come where Python can only report it; then it comes again
        sys.unraisablehook = lambda _: None
        while not self.turn.acquire(timeout=0.1):  # kept for ever, so that no answer begins
            if self.answering is not None:
                set_exception = ctypes.pythonapi.PyThreadState_SetAsyncExc
                set_exception(ctypes.c_ulong(self.answering), ctypes.py_object(SystemExit))

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Ignore clients that go away in the middle of a request, and nothing else."""
        if not isinstance(sys.exception(), OSError):
            super().handle_error(request, client_address)


class Handler(BaseHTTPRequestHandler):
    """One request and its answer; the connection is closed after it."""

    server: PressServer
    timeout = 10.0

    def do_GET(self) -> None:
        """Send the page."""
        if not self._is_allowed():
            return
        if self.path == f"/{self.server.token}/":
            self._send(HTTPStatus.OK, self.server.page, "text/html; charset=utf-8")
        else:
            self._refuse(HTTPStatus.NOT_FOUND, "there is nothing here.")

    def do_POST(self) -> None:
        """Send the answer of a model to presses, or to a knife."""
        if not self._is_allowed():
            return
        answer = self.server.answers.get(self.path.removeprefix(f"/{self.server.token}/"))
        length = self.headers.get("Content-Length", "")
        if answer is None:
            self._refuse(HTTPStatus.NOT_FOUND, "there is nothing here.")
        elif self.headers.get_content_type() != "application/json":
            self._refuse(HTTPStatus.UNSUPPORTED_MEDIA_TYPE, "post JSON as application/json.")
        elif not length.isdecimal() or int(length) > MAX_BYTES:
            self._refuse(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, f"say how long the body is, {MAX_BYTES} bytes at most.")
        else:
            self._answer(answer, self.rfile.read(int(length)))

    def log_message(self, format: str, *args: Any) -> None:
        """Log nothing."""

    def _is_allowed(self) -> bool:
        """Return whether the request is for this machine and from a page of it; refuse it if not."""
        host, origin = self.headers.get("Host"), self.headers.get("Origin")
        if host in self.server.hosts and origin in (None, f"http://{host}"):
            return True
        self._refuse(HTTPStatus.FORBIDDEN, "this address is not served.")
        return False

    def _answer(self, answer: Answer, body: bytes) -> None:
        try:
            with self.server.turn:
                self.server.answering = threading.get_ident()
                content = answer(body)
        except InputError as error:
            self._refuse(HTTPStatus.BAD_REQUEST, str(error))
        except NotConverged as error:
            self._refuse(HTTPStatus.UNPROCESSABLE_ENTITY, f"{error}.")
        except Exception:
            traceback.print_exc()
            self._refuse(HTTPStatus.INTERNAL_SERVER_ERROR, "this model failed; the terminal of palpate press says how.")
        else:
            self._send(HTTPStatus.OK, content, "application/json")

    def _refuse(self, status: HTTPStatus, sentence: str) -> None:
        self.close_connection = True
        self._send(status, f"{sentence}\n".encode(), "text/plain; charset=utf-8")

    def _send(self, status: HTTPStatus, content: bytes, kind: str) -> None:
        self.send_response(status)
        for name, value in (_HEADERS | {"Content-Type": kind, "Content-Length": str(len(content))}).items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(content)
