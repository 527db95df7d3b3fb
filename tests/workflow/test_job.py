"""How a job ends, and what it says on its way."""

import shutil
import warnings
from pathlib import Path

import pytest

from palpate.errors import InputError
from palpate.run import job as job_module
from palpate.run.job import job, steps


@pytest.fixture(autouse=True)
def outside_a_run(monkeypatch):
    monkeypatch.delenv("PALPATE_RUN", raising=False)


def test_bad_input_is_one_sentence_on_the_terminal_and_in_the_log(tmp_path, capfd):
    with pytest.raises(SystemExit) as ended, job(tmp_path / "a.log"):
        raise InputError("liver.msh: node 3 is infinite; repair the file.")
    assert ended.value.code == 1
    assert capfd.readouterr().err == "error: liver.msh: node 3 is infinite; repair the file.\n"
    assert (tmp_path / "a.log").read_text() == "error: liver.msh: node 3 is infinite; repair the file.\n"


def test_the_traceback_of_a_fault_is_in_the_log_only(tmp_path, capfd):
    log = tmp_path / "a.log"
    with pytest.raises(SystemExit) as ended, job(log):
        raise ZeroDivisionError("oh")
    assert ended.value.code == 1
    said = capfd.readouterr().err
    assert said == f"error: ZeroDivisionError: oh (a fault of palpate's; the traceback is in {log})\n"
    assert "Traceback" in log.read_text()


def test_steps_hands_on_everything_and_says_the_first_and_last():
    said = []
    assert list(steps(said.append, "sample")([7, 8, 9])) == [7, 8, 9]
    assert said == ["sample 1 of 3", "sample 3 of 3"]


def test_an_edit_of_a_kernel_changes_the_cache(tmp_path, monkeypatch):
    package = tmp_path / "palpate"
    shutil.copytree(Path(job_module.__file__).parent, package, ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(job_module, "__file__", str(package / "job.py"))
    before = job_module.kernel_cache()
    assert before == job_module.kernel_cache()
    (package / "config.py").write_text("no kernel here\n")
    assert before == job_module.kernel_cache()
    svd = package / "linalg/polar.py"
    svd.write_text(svd.read_text() + "\n")
    assert before != job_module.kernel_cache()


def test_what_palpate_warns_of_stands_in_the_log(tmp_path, monkeypatch):
    """Others' warnings do not, and neither changes how warnings are shown afterwards."""
    others = []
    monkeypatch.setattr(warnings, "showwarning", lambda message, *_: others.append(str(message)))
    warnings.simplefilter("always")
    before = warnings.showwarning
    with job(str(tmp_path / "log")):
        warnings.warn("the organ is cut", stacklevel=1)
        warnings.warn("old", DeprecationWarning, stacklevel=1)
    assert "warning: the organ is cut" in (tmp_path / "log").read_text()
    assert "old" not in (tmp_path / "log").read_text()
    assert others == ["old"]
    assert warnings.showwarning is before
