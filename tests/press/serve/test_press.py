"""``palpate press``: a finished run's body in a browser of this machine, until it is told to end."""

import base64
import json
import os
import re
import signal
import socket
import subprocess
import sys
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import pytest

from palpate.benchmark.load import Load
from palpate.cli import main
from palpate.errors import InputError
from palpate.models import fem
from palpate.press.finished_run import FinishedRun
from palpate.press.serve.command import _page, find_run
from palpate.press.serve.live_models import LiveModels
from palpate.studies.press import coarse_answer


@pytest.fixture(scope="module")
def live(finished) -> LiveModels:
    return LiveModels(FinishedRun(finished / "config.yaml", finished / "results"), "slab_large")


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
    setting = {"level": 1, "start": "rest", "tolerance": 1e-3}
    expected = fem.Fem(case, setting, 1).respond(Load.at(contact, force))
    assert np.abs(found - expected).max() < 1e-4 * np.abs(expected).max()
    assert said["forces"] == [force.tolist()] and said["error"] is None and said["doubt"] == "" and said["ms"] > 0


def files(folder: Path) -> dict[str, bytes]:
    return {str(path): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


COMMAND = "import sys; from palpate.cli import main; sys.exit(main(sys.argv[1:]))"
# an answer that never comes, as its functions are compiled for ever
FOR_EVER = """
import atexit
from numba import njit
from palpate.press.serve.live_models import LiveModels
def answer(self, name, body):
    print("asked", flush=True)
    while True:
        njit(lambda x: x + 1)(1)
LiveModels.answer = answer
atexit.register(print, "Python takes down what the answer needs")
"""


@contextmanager
def pressed(finished: Path, folder: Path, before: str = "") -> Iterator[tuple[subprocess.Popen, str]]:
    """Start the command, after what changes it, and yield it with its address; it is gone afterwards."""
    words = ["press", "--config", str(finished / "config.yaml"), "--no-browser"]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    run = subprocess.Popen([sys.executable, "-c", before + COMMAND, *words], cwd=folder, env=dict(os.environ), **pipes)
    try:
        found = re.search(r"slab_large can be pressed at (http://127\.0\.0\.1:\d+/[\w-]+/)", run.stdout.readline())
        yield run, found[1]
    finally:
        run.kill()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_it_serves_until_it_is_stopped_writes_nothing_and_ends_well(finished, tmp_path, number):
    before = files(finished)
    with pressed(finished, tmp_path) as (run, address):
        page = urllib.request.urlopen(address, timeout=20).read().decode()
        run.send_signal(number)
        out, err = run.communicate(timeout=20)
    assert "Press it: slab large" in page and '"url":"answer/fem_p1"' in page
    assert (run.returncode, out.splitlines()[-1], err) == (0, "closed", "preparing slab_large ...\n")
    assert files(finished) == before and list(tmp_path.iterdir()) == []


def test_it_ends_in_the_middle_of_an_answer(finished, live, tmp_path):
    body = posted(live)
    with pressed(finished, tmp_path, FOR_EVER) as (run, address):
        client = socket.create_connection(("127.0.0.1", urlsplit(address).port), timeout=20)
        head = f"POST {urlsplit(address).path}answer/fem_p1 HTTP/1.1\r\nHost: {urlsplit(address).netloc}\r\n"
        kind = f"Content-Type: application/json\r\nContent-Length: {len(body)}\r\n\r\n"
        with client:
            client.sendall((head + kind).encode() + body)
            assert [run.stdout.readline() for _ in range(2)][-1] == "asked\n"
            run.send_signal(signal.SIGINT)
            out, err = run.communicate(timeout=20)
    assert (run.returncode, out.splitlines()[-1], err) == (0, "closed", "preparing slab_large ...\n")


def test_the_coarse_meshs_answer_can_stand_beside_the_model(live, finished):
    page = _page(live, FinishedRun(finished / "config.yaml", finished / "results"), "slab_large", None)
    head = json.loads(re.search(r'<script class="head" type="application/json">(.*?)</script>', page)[1])
    assert [(each["name"], each["kind"]) for each in head["models"]] == [("fem_p1", "portable"), ("coarse", "coarse")]
    assert head["models"][1]["info"] == {"peak_m": live.peak, "hardest_n": live.hardest}
    packed = base64.b64decode(re.search(r'data-model="coarse">(.*?)</script>', page)[1])
    assert packed == coarse_answer.packed(coarse_answer.coarse_answer(live.case.body, 0.03))


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
