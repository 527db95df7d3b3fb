"""Read one request of a client that may be slow, strange or malicious, and answer or refuse it.

Trap: any page that a browser shows can send requests to 127.0.0.1, under a name of its own, too. So the address holds
a token, the Host must be this machine's, and presses must be JSON, which other pages may not post.
"""

import socket
import threading
import traceback
from contextlib import suppress
from hmac import compare_digest
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler
from typing import TYPE_CHECKING, Any

from palpate.errors import InputError, NotConverged

if TYPE_CHECKING:
    from palpate.press.serve.server import PressServer

LARGEST = 8192
"""Bytes of a body; two presses have 300."""
PATIENCE_S = 10.0
"""Time within which a whole request must have come."""
LINGER_S = 0.5
"""Time for which the rest of a refused request is waited for."""
_HEADERS = {
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",  # the address holds the token
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Cross-Origin-Resource-Policy": "same-origin",
}


class Handler(BaseHTTPRequestHandler):
    """One request and its answer; the connection is closed after it."""

    server: "PressServer"
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
                self.server.has_come(self.connection)
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
        self._alarm.cancel()  # from here on it is the client who waits
        self.server.has_come(self.connection)
        try:
            with self.server.turn:
                if self._has_left():
                    return
                found = self.server.answer(name, body)
        except InputError as error:
            self._refuse(HTTPStatus.BAD_REQUEST, str(error))
        except NotConverged as error:
            self._refuse(HTTPStatus.UNPROCESSABLE_ENTITY, f"{error}.")
        except Exception:
            traceback.print_exc()
            self._refuse(HTTPStatus.INTERNAL_SERVER_ERROR, "this model failed; the terminal of palpate press says how.")
        else:
            self._send(HTTPStatus.OK, found, "application/json")

    def _has_left(self) -> bool:
        """Return whether the client has hung up; nobody waits for the answer to a tab that was closed."""
        self.connection.setblocking(False)
        try:
            return not self.connection.recv(1, socket.MSG_PEEK)
        except BlockingIOError:
            return False
        except OSError:
            return True
        finally:
            self.connection.settimeout(PATIENCE_S)

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
        more = {"Content-Type": kind, "Content-Length": str(len(content))}
        if status == HTTPStatus.METHOD_NOT_ALLOWED:
            more["Allow"] = "GET, POST"
        for name, value in (_HEADERS | more).items():
            self.send_header(name, value)
        self.end_headers()
        if self.command != "HEAD":  # whose answers have no body
            self.wfile.write(content)

    def _hang_up(self) -> None:
        with suppress(OSError):
            self.connection.shutdown(socket.SHUT_RD)
