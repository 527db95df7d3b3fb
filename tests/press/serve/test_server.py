"""The server answers whoever knows its address, and refuses everything else with a 4xx and one sentence."""

import json
import re
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest

from palpate.errors import InputError, NotConverged
from palpate.press.serve.server import LARGEST, PressServer

PAGE = "<!doctype html><p>größer</p>"


def answer(name: str, body: bytes) -> bytes:
    """Echo what is asked, or refuse it, as models do."""
    if body == b'"wrong"':
        raise InputError("a press is on no triangle of the body; give another.")
    if body == b'"hard"':
        raise NotConverged("the solver stopped", [1.0])
    return json.dumps([name, json.loads(body)]).encode()


@contextmanager
def serving(page: str, answer: Callable[[str, bytes], bytes]) -> Iterator[PressServer]:
    with PressServer() as server:
        server.offer(page, ["fem_p2", "modes"], answer)
        threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True).start()
        yield server
        server.shutdown()


@pytest.fixture(scope="module")
def served():
    with serving(PAGE, answer) as server:
        yield server


def send(server: PressServer, request: bytes) -> tuple[int, str, str]:
    """Send bytes as they are; return status, headers and body of what comes back."""
    with socket.create_connection(server.server_address, timeout=5) as client:
        client.sendall(request)
        got = b""
        while part := client.recv(65536):
            got += part
    head, _, body = got.partition(b"\r\n\r\n")
    return int(head.split()[1]), head.decode(), body.decode()


def get(server: PressServer, path: str, method: str = "GET", **headers: str) -> tuple[int, str, str]:
    given = {"Host": server.hosts[0], **{name.replace("_", "-"): value for name, value in headers.items()}}
    lines = "".join(f"{name}: {value}\r\n" for name, value in given.items())
    return send(server, f"{method} {path} HTTP/1.1\r\n{lines}\r\n".encode())


def post(server: PressServer, path: str, body: bytes, drop: str = "", **headers: str) -> tuple[int, str, str]:
    given = {"Host": server.hosts[0], "Content-Type": "application/json", "Content-Length": str(len(body))}
    given |= {name.replace("_", "-"): value for name, value in headers.items()}
    lines = "".join(f"{name}: {value}\r\n" for name, value in given.items() if name != drop)
    return send(server, f"POST {path} HTTP/1.1\r\n{lines}\r\n".encode() + body)


def test_its_address_leads_to_the_page_which_may_not_be_kept_framed_or_told_about(served):
    path = re.fullmatch(r"http://127\.0\.0\.1:\d+(/[\w-]{32}/)", served.address)[1]
    status, head, body = get(served, path)
    assert (status, body) == (200, PAGE)
    for line in ("Cache-Control: no-store", "X-Frame-Options: DENY", "Referrer-Policy: no-referrer"):
        assert line in head
    assert "Python" not in head
    assert get(served, path, Host=served.hosts[1])[0] == 200


def test_it_listens_to_this_machine_only_and_another_has_another_token(served):
    assert served.socket.getsockname()[0] == "127.0.0.1"
    with PressServer() as other:
        assert other.token != served.token and other.server_port != served.server_port


def test_each_model_answers_under_its_name(served):
    for name in served.names:
        status, head, body = post(served, f"/{served.token}/answer/{name}", b'{"presses": []}')
        assert (status, json.loads(body)) == (200, [name, {"presses": []}])
        assert "Content-Type: application/json" in head


def test_what_a_model_cannot_answer_is_said_in_a_sentence(served):
    path = f"/{served.token}/answer/modes"
    assert post(served, path, b'"wrong"')[::2] == (400, "a press is on no triangle of the body; give another.\n")
    assert post(served, path, b'"hard"')[::2] == (422, "the solver stopped.\n")


@pytest.mark.parametrize("path", ["/", "//", "/{t}", "/{t}x/", "/{t}/answer/modes", "/{t}/..", "/{t}/?", "*", "/{u}/"])
def test_other_paths_are_not_there(served, path):
    path = path.format(t=served.token, u=served.token.swapcase())
    assert get(served, path)[0] in (400, 404)


@pytest.mark.parametrize("path", ["/answer/modes", "/{t}/", "/{t}/answer/", "/{t}/answer/other", "/x/answer/modes"])
def test_nothing_is_posted_elsewhere(served, path):
    assert post(served, path.format(t=served.token), b"{}")[::2] == (404, "there is nothing here.\n")


@pytest.mark.parametrize("method", ["HEAD", "PUT", "DELETE", "OPTIONS", "CONNECT", "TRACE", "PATCH", "get"])
def test_other_methods_are_refused(served, method):
    status, head, body = get(served, f"/{served.token}/", method)
    assert status == 405 and "\r\nAllow: GET, POST" in head
    assert body == ("" if method == "HEAD" else "this request is not understood.\n")


@pytest.mark.parametrize("host", ["palpate.example", "127.0.0.1", "localhost:1", "127.0.0.1:1", "", "[::1]:{port}"])
def test_other_names_of_this_machine_are_refused(served, host):
    """A page of elsewhere may have its own name point here."""
    host = host.format(port=served.server_port)
    assert get(served, f"/{served.token}/", Host=host)[::2] == (403, "this address is not served.\n")
    assert post(served, f"/{served.token}/answer/modes", b"{}", Host=host)[0] == 403


def test_a_page_of_elsewhere_may_not_post(served):
    path = f"/{served.token}/answer/modes"
    assert post(served, path, b"{}", Origin="http://palpate.example")[0] == 403
    assert post(served, path, b"{}", Origin=f"http://{served.hosts[0]}")[0] == 200
    assert post(served, path, b"{}", Content_Type="text/plain")[0] == 415
    assert get(served, f"/{served.token}/", Origin="null")[0] == 403


@pytest.mark.parametrize(
    ("words", "status"),
    [
        ({"Content_Length": str(LARGEST + 1)}, 413),
        ({"Content_Length": "9" * 5000}, 413),
        ({"Content_Length": "-1"}, 411),
        ({"Content_Length": "²"}, 411),
        ({"drop": "Content-Length"}, 411),
        ({"drop": "Host"}, 403),
        ({"drop": "Content-Type"}, 415),
    ],
)
def test_bodies_that_are_too_large_or_of_no_length_are_refused(served, words, status):
    assert post(served, f"/{served.token}/answer/modes", b"{}", **words)[0] == status


@pytest.mark.parametrize(
    "request_line",
    [b"\x00\xff\r\n\r\n", b"GET\r\n\r\n", b"GET / HTTP/9.9\r\n\r\n", b"GET / HTTP/1.1 more\r\n\r\n",
     b"GET /" + b"a" * 70_000 + b" HTTP/1.1\r\n\r\n", b"GET / HTTP/1.1\r\n" + b"a: b\r\n" * 200 + b"\r\n",
     b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03\r\n\r\n"],
)  # fmt: skip
def test_what_is_no_request_is_refused(served, request_line):
    with socket.create_connection(served.server_address, timeout=5) as client:
        client.sendall(request_line)
        client.shutdown(socket.SHUT_WR)
        got = b""
        while part := client.recv(65536):
            got += part
    assert re.match(rb"HTTP/1\.\d 4\d\d |this request is not understood", got)
    assert PAGE.encode() not in got and b"Traceback" not in got


def connected(server: PressServer) -> socket.socket:
    return socket.create_connection(server.server_address, timeout=5)


def test_a_model_that_breaks_is_said_to_and_shown_in_the_terminal(capfd):
    def broken(name: str, body: bytes) -> bytes:
        raise ZeroDivisionError("of a model")

    with serving(PAGE, broken) as server:
        status, _, said = post(server, f"/{server.token}/answer/modes", b"{}")
        assert (status, said) == (500, "this model failed; the terminal of palpate press says how.\n")
    assert "ZeroDivisionError: of a model" in capfd.readouterr().err


def test_clients_that_leave_in_the_middle_are_not_spoken_of(capfd):
    large = 4_000_000  # more than a connection holds
    with serving("x" * large, answer) as server:
        with connected(server) as client:
            client.sendall(f"GET /{server.token}/ HTTP/1.1\r\nHost: {server.hosts[0]}\r\n\r\n".encode())
            client.recv(1)
        assert len(get(server, f"/{server.token}/")[2]) == large
    assert capfd.readouterr().err == ""


def test_a_port_that_is_taken_gets_one_sentence(served):
    with pytest.raises(
        InputError, match=rf"^port {served.server_port} cannot be had \(.*\); give another one with --port\.$"
    ):
        PressServer(served.server_port)
