"""``palpate press``: a finished run's body in a browser of this machine, until it is told to end."""

import base64
import json
import os
import re
import signal
import subprocess
import sys
import urllib.request
from pathlib import Path

import numpy as np
import pytest

from palpate.cli import main
from palpate.errors import InputError
from palpate.evaluation.tradeoff.finished_run import FinishedRun
from palpate.models import fem
from palpate.models.load import Load
from palpate.serve.command import find_run
from palpate.serve.live_models import LiveModels


@pytest.fixture(scope="module")
def live(finished) -> LiveModels:
    return LiveModels(FinishedRun(finished / "config.yaml", finished / "results"), "slab_large")


def test_the_best_setting_that_answers_soon_and_anywhere_is_taken(live):
    assert live.names == ["fem_p1"]
    assert live.rows["fem_p1"]["setting"] == "level=1, start=rest, tolerance=0.001"


def test_it_answers_as_the_model_does_at_a_node(live):
    case = live.case
    assert case.radius_m == 0.03
    contact, force = int(case.database.contact[0]), case.database.force[0]
    row = int(np.searchsorted(case.body.fine.surface, contact))
    triangle, corner = (int(each[0]) for each in np.nonzero(case.database.triangles == row))
    press = {"triangle": triangle, "weights": np.eye(3)[corner].tolist(), "force": force.tolist()}
    said = json.loads(live.answer("fem_p1", json.dumps({"presses": [press]}).encode()))
    found = np.frombuffer(base64.b64decode(said["displacement"]), "<f4").reshape(-1, 3)
    setting = {"level": 1, "start": "rest", "tolerance": 1e-3}
    expected = fem.prepare(case, setting, 1).respond(Load.at(contact, force))
    assert np.abs(found - expected).max() < 1e-4 * np.abs(expected).max()
    assert said["forces"] == [force.tolist()] and said["error"] is None and said["doubt"] == "" and said["ms"] > 0


def files(folder: Path) -> dict[str, bytes]:
    return {str(path): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_it_serves_until_it_is_stopped_writes_nothing_and_ends_well(finished, tmp_path, number):
    before = files(finished)
    command = "import sys; from palpate.cli import main; sys.exit(main(sys.argv[1:]))"
    words = ["press", "--config", str(finished / "config.yaml"), "--no-browser"]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    run = subprocess.Popen([sys.executable, "-c", command, *words], cwd=tmp_path, env=dict(os.environ), **pipes)
    try:
        address = re.search(r"slab_large can be pressed at (http://127\.0\.0\.1:\d+/[\w-]+/)", run.stdout.readline())[1]
        page = urllib.request.urlopen(address, timeout=20).read().decode()
        run.send_signal(number)
        out, err = run.communicate(timeout=20)
    finally:
        run.kill()
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


def test_a_run_is_found_by_its_settings_or_its_results(finished, tmp_path):
    by_config = find_run(finished / "config.yaml", None)
    by_results = find_run(None, finished / "results")
    assert by_config.results.samefile(by_results.results) and by_config.config.samefile(by_results.config)
    with pytest.raises(InputError, match=r"has no config\.yaml; give the settings of the run with --config\."):
        find_run(None, tmp_path / "results")
    (tmp_path / "config.yaml").write_text("")
    with pytest.raises(InputError, match=r"results holds no finished run with the study tradeoff; type make CONFIG="):
        find_run(tmp_path / "config.yaml", None)
