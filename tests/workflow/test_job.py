"""How a job ends, and what it says on its way."""

import shutil
import warnings

import pytest

from palpate.errors import InputError
from palpate.run import dependencies
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
    (package / "run").mkdir(parents=True)
    for name in ("linalg/polar.py", "errors.py"):
        (package / name).parent.mkdir(exist_ok=True)
        shutil.copy(dependencies.PACKAGE / name, package / name)
    monkeypatch.setattr(dependencies, "PACKAGE", package)
    monkeypatch.setattr(dependencies, "KEPT", tmp_path / "digests.json")

    def digest() -> str:
        dependencies._facts.cache_clear()
        return dependencies.kernels()

    before = digest()
    (package / "errors.py").write_text("NONE = 0\n")
    svd = package / "linalg/polar.py"
    svd.write_text(f"# a comment\n{svd.read_text()}")
    assert digest() == before
    svd.write_text(f"{svd.read_text()}\nONE = 1\n")
    assert digest() != before


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
