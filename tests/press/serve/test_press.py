"""``palpate press``: a finished run's body in a browser of this machine, and nothing to anyone else."""

import base64
import json
import os
import re
import signal
import socket
import subprocess
import sys
import threading
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from palpate.benchmark.load import Load
from palpate.cli import main
from palpate.errors import InputError, NotConverged
from palpate.models.kinds import FEM
from palpate.press.serve.command import find_run
from palpate.press.serve.live_models import LiveModels
from palpate.press.serve.server import MAX_BYTES, PressServer


def test_the_best_setting_that_answers_soon_and_anywhere_is_taken(live):
    assert live.names == ["fem_p1"]
    assert live.rows["fem_p1"]["setting"] == "level=1, start=rest, tolerance=0.001"


def posted(live: LiveModels) -> bytes:
    """Return the first sample's press as a page posts it: at the corner of a triangle."""
    database = live.case.database
    row = int(np.searchsorted(live.case.body.fine.surface, database.contact[0]))
    triangle, corner = (int(each[0]) for each in np.nonzero(database.triangles == row))
    press = {"triangle": triangle, "weights": np.eye(3)[corner].tolist(), "force": database.force[0].tolist()}
    return json.dumps({"presses": [press]}).encode()


def test_it_answers_as_the_model_does_at_a_node(live):
    case = live.case
    assert case.radius_m == 0.03
    contact, force = int(case.database.contact[0]), case.database.force[0]
    said = json.loads(live.answer("fem_p1", posted(live)))
    found = np.frombuffer(base64.b64decode(said["displacement"]), "<f4").reshape(-1, 3)
    expected = FEM(order=1, level=1, tolerance=1e-3).prepare(case).respond(Load.at(contact, force))
    assert np.abs(found - expected).max() < 1e-4 * np.abs(expected).max()
    assert said["forces"] == [force.tolist()] and said["error"] is None and said["doubt"] == "" and said["ms"] > 0


def files(folder: Path) -> dict[str, bytes]:
    return {str(path): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


COMMAND = "import sys; from palpate.cli import main; sys.exit(main(sys.argv[1:]))"


@contextmanager
def pressed(finished: Path, folder: Path) -> Iterator[tuple[subprocess.Popen, str]]:
    """Start the command, and yield it with its address; it is gone afterwards."""
    words = ["press", "--config", str(finished / "config.yaml"), "--no-browser"]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    run = subprocess.Popen([sys.executable, "-c", COMMAND, *words], cwd=folder, env=dict(os.environ), **pipes)
    try:
        found = re.search(r"slab_large can be pressed at (http://127\.0\.0\.1:\d+/[\w-]+/)", run.stdout.readline())
        yield run, found[1]
    finally:
        run.kill()


@pytest.mark.slow
def test_it_serves_until_it_is_stopped_writes_nothing_and_ends_well(finished, tmp_path):
    before = files(finished)
    with pressed(finished, tmp_path) as (run, address):
        page = urllib.request.urlopen(address, timeout=20).read().decode()
        run.send_signal(signal.SIGINT)
        out, err = run.communicate(timeout=20)
    assert "Press it: slab large" in page and '"url":"answer/fem_p1"' in page
    assert (run.returncode, out.splitlines()[-1], err) == (0, "closed", "preparing slab_large ...\n")
    assert files(finished) == before and list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--scene", "slab_small"], r"--scene slab_small is not in .*results; choose from slab_large\."),
        (["--model", "springs"], r"--model springs was not measured in .*; choose from fem_p1, linear_fem\."),
        (["--model", "linear_fem"], r"--model linear_fem answers at prepared contacts only; choose from fast_fem, "),
        (["--port", "0"], r"0 is not a port; give a number from 1 to 65535"),
    ],
)
def test_what_there_is_not_gets_one_sentence(capsys, finished, words, said):
    assert main(["press", "--config", str(finished / "config.yaml"), "--no-browser", *words]) == 1
    printed = capsys.readouterr().err
    assert re.search(said, printed) and printed.count("error: ") == 1 and "Traceback" not in printed


def test_a_port_in_use_is_said_before_anything_is_prepared(capsys, finished, monkeypatch):
    monkeypatch.setattr(LiveModels, "__init__", lambda *_: pytest.fail("something is prepared"))
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        words = ["--config", str(finished / "config.yaml"), "--no-browser", "--port", str(port)]
        assert main(["press", *words]) == 1
    said = capsys.readouterr().err
    assert re.fullmatch(rf"error: port {port} cannot be had \(.*\); give another one with --port\.\n", said)


def test_a_run_is_found_by_its_settings_or_its_results(finished, tmp_path):
    by_config = find_run(finished / "config.yaml", None)
    by_results = find_run(None, finished / "results")
    assert by_config.results.samefile(by_results.results) and by_config.config.samefile(by_results.config)
    with pytest.raises(InputError, match="results: there is no such folder; give the results of a run"):
        find_run(None, tmp_path / "results")
    (tmp_path / "results").mkdir()
    with pytest.raises(InputError, match=r"has no config\.yaml; give the settings of the run with --config\."):
        find_run(None, tmp_path / "results")
    with pytest.raises(InputError, match=r"config\.yaml: there is no such file; give the settings of the run\."):
        find_run(tmp_path / "config.yaml", None)
    (tmp_path / "config.yaml").write_text("")
    with pytest.raises(InputError, match=r"results holds no finished run with the study tradeoff; type make CONFIG="):
        find_run(tmp_path / "config.yaml", None)


NAMES = ("fem_p2", "modes")
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
        server.offer(page, {f"answer/{name}": partial(answer, name) for name in NAMES})
        threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True).start()
        yield server
        server.shutdown()


@pytest.fixture(scope="module")
def served():
    with serving(PAGE, answer) as server:
        yield server


def get(server: PressServer, path: str, body: bytes | None = None, **headers: str | None) -> tuple[int, str, str]:
    """Get a path, or post a body to it; return status, headers and what comes back. None leaves a header out."""
    given = {"Host": server.hosts[0]}
    given |= {} if body is None else {"Content-Type": "application/json", "Content-Length": str(len(body))}
    given |= {name.replace("_", "-"): value for name, value in headers.items()}
    lines = "".join(f"{name}: {value}\r\n" for name, value in given.items() if value is not None)
    with socket.create_connection(server.server_address, timeout=5) as client:
        client.sendall(f"{'GET' if body is None else 'POST'} {path} HTTP/1.1\r\n{lines}\r\n".encode() + (body or b""))
        got = b""
        while part := client.recv(65536):
            got += part
    head, _, said = got.partition(b"\r\n\r\n")
    return int(head.split()[1]), head.decode(), said.decode()


def test_its_address_leads_to_the_page_which_may_not_be_kept_framed_or_told_about(served):
    path = re.fullmatch(r"http://127\.0\.0\.1:\d+(/[\w-]{32}/)", served.address)[1]
    status, head, body = get(served, path)
    assert (status, body) == (200, PAGE)
    for line in ("Cache-Control: no-store", "X-Frame-Options: DENY", "Referrer-Policy: no-referrer"):
        assert line in head
    assert get(served, path, Host=served.hosts[1])[0] == 200


def test_it_listens_to_this_machine_only_and_another_has_another_token(served):
    assert served.socket.getsockname()[0] == "127.0.0.1"
    with PressServer() as other:
        assert other.token != served.token and other.server_port != served.server_port


def test_each_model_answers_under_its_name_or_says_why_it_cannot(served):
    for name in NAMES:
        status, head, body = get(served, f"/{served.token}/answer/{name}", b'{"presses": []}')
        assert (status, json.loads(body)) == (200, [name, {"presses": []}])
        assert "Content-Type: application/json" in head
    path = f"/{served.token}/answer/modes"
    assert get(served, path, b'"wrong"')[::2] == (400, "a press is on no triangle of the body; give another.\n")
    assert get(served, path, b'"hard"')[::2] == (422, "the solver stopped.\n")


@pytest.mark.parametrize("path", ["/", "/{t}", "/{t}/..", "/{u}/", "/{t}/answer/other"])
@pytest.mark.parametrize("body", [None, b"{}"])
def test_there_is_nothing_elsewhere(served, path, body):
    path = path.format(t=served.token, u=served.token.swapcase())
    assert get(served, path, body)[::2] == (404, "there is nothing here.\n")


@pytest.mark.parametrize("host", ["palpate.example", "localhost:1", None])
def test_other_names_of_this_machine_are_refused(served, host):
    """A page of elsewhere may have its own name point here."""
    for path, body in ((f"/{served.token}/", None), (f"/{served.token}/answer/modes", b"{}")):
        assert get(served, path, body, Host=host)[::2] == (403, "this address is not served.\n")


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"Origin": "http://palpate.example"}, 403),
        ({"Origin": "http://{host}"}, 200),
        ({"Content_Type": "text/plain"}, 415),
        ({"Content_Length": str(MAX_BYTES + 1)}, 413),
        ({"Content_Length": None}, 413),
    ],
)
def test_a_page_of_elsewhere_may_not_post_nor_anyone_a_body_that_is_too_large(served, headers, status):
    headers = {name: value and value.format(host=served.hosts[0]) for name, value in headers.items()}
    assert get(served, f"/{served.token}/answer/modes", b"{}", **headers)[0] == status


def test_a_model_that_breaks_is_said_to_and_shown_in_the_terminal(capfd):
    def broken(name: str, body: bytes) -> bytes:
        raise ZeroDivisionError("of a model")

    with serving(PAGE, broken) as server:
        status, _, said = get(server, f"/{server.token}/answer/modes", b"{}")
        assert (status, said) == (500, "this model failed; the terminal of palpate press says how.\n")
    assert "ZeroDivisionError: of a model" in capfd.readouterr().err
