"""A job that the server forks is as one that the interpreter starts: streams, folder, environment, and how it ends."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from palpate.run.job_server import start

pytestmark = pytest.mark.slow

CLIENT = Path(__file__).parents[2] / "workflow/start_job.py"
LOOK = """
import os, pathlib, sys
print(os.getcwd(), os.environ["SAID"], sys.argv[1:], __name__, __file__ == sys.argv[0], sys.stdin.read())
known = "palpate.run", "palpate.kernel_store"  # numba has the latter store what it compiles
print("numba" in sys.modules, any(name.startswith("palpate.") for name in sys.modules if name not in known))
print(sys.path[0] == str(pathlib.Path(__file__).parent), file=sys.stderr)
"""


@pytest.fixture(params=["forked", "started"])
def way(request, tmp_path, monkeypatch):
    """Run in a folder with a server, and in one without."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PALPATE_JOBS", "jobs")
    server = start(sys.executable, "jobs", {}) if request.param == "forked" else None
    while server and not Path("jobs").exists():
        time.sleep(0.01)
    yield request.param
    if server:
        server.kill()
        server.wait()


def begin(text, **more):
    script = Path("script.py").absolute()
    script.write_text(text)
    return subprocess.Popen(
        [sys.executable, "-IS", CLIENT, script], text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE, **more
    )


def test_a_script_has_its_streams_folder_environment_and_name(way, tmp_path):
    job = begin(LOOK, stdin=subprocess.PIPE, env={**os.environ, "SAID": "yes"})
    out, err = job.communicate("in")
    imported = way == "forked"
    assert out == f"{tmp_path} yes [] __main__ True in\n{imported} False\n" and err == "True\n"
    assert job.returncode == 0


@pytest.mark.parametrize(
    ("text", "status", "said"),
    [
        ("raise SystemExit(3)", 3, ""),
        ("import sys; sys.exit('no')", 1, "no\n"),
        ("import atexit; atexit.register(lambda: print('last')); 1 / 0", 1, "ZeroDivisionError: division by zero\n"),
        ("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)", -signal.SIGSEGV, ""),
        ("import os, signal; os.kill(os.getpid(), signal.SIGKILL)", -signal.SIGKILL, ""),
    ],
)
def test_it_ends_as_it_would_alone(way, text, status, said):
    job = begin(text)
    out, err = job.communicate()
    assert job.returncode == status and err.endswith(said)
    assert out == ("last\n" if "last" in text else "")


def test_two_jobs_run_beside_each_other_and_one_whose_asker_is_killed_ends(way):
    waits = "import os, time; print(os.getpid(), flush=True); time.sleep(60)"
    first = begin(waits)
    process = psutil.Process(int(first.stdout.readline()))
    second = begin("print('done')")
    assert second.communicate()[0] == "done\n" and process.is_running()
    first.kill()
    process.wait(timeout=10)


def test_options_are_the_interpreter_s(way):
    job = subprocess.run([sys.executable, "-IS", CLIENT, "-c", "print(6 * 7)"], capture_output=True, text=True)
    assert job.stdout == "42\n"


def test_the_server_ends_with_the_process_that_started_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code = "import sys; from palpate.run.job_server import start; print(start(sys.executable, 'jobs', {}).pid)"
    done = subprocess.run([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, check=True)
    psutil.Process(int(done.stdout)).wait(timeout=60)
    assert not Path("jobs").exists()
