"""How a job ends, and what it says; warnings are kept, each once, for the end of a run and for the report."""

import warnings

import pytest
from fixtures.bodies import made
from fixtures.small_scene import BAR

from palpate.bodies.particles import particles_of
from palpate.effects import linear_elements
from palpate.errors import InputError, about
from palpate.files import load_warnings, save_warnings
from palpate.run import dependencies
from palpate.run.job import job
from palpate.solvers.equilibrium import Equilibrium


@pytest.mark.parametrize(
    "asked", [Equilibrium, lambda body, level: linear_elements.make(particles_of(body, level, False), {})]
)
def test_linear_elements_near_incompressibility_warn_and_quadratic_ones_do_not(asked):
    with pytest.warns(UserWarning, match=r"^organ: linear elements lock at Poisson's ratio 0\.49; .* missed about 12%"):
        asked(made("organ", BAR | {"poisson": 0.49}), 0)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        asked(made("organ", BAR | {"poisson": 0.45}), 0)
        Equilibrium(made("organ", BAR | {"poisson": 0.49, "refinements": 1}), 0, order=2)


def test_warnings_below_a_body_get_its_name_also_if_it_fails(recwarn):
    with pytest.raises(InputError), about("bodies.spleen"):
        warnings.warn("scan.nii: the organ is cut.", stacklevel=1)
        warnings.warn("old", DeprecationWarning, stacklevel=1)
        raise InputError("no")
    assert [str(one.message) for one in recwarn] == ["bodies.spleen: scan.nii: the organ is cut.", "old"]


def test_a_job_keeps_what_it_warns_of_and_forgets_it_when_it_no_longer_does(tmp_path):
    log, warned = tmp_path / "a.log", tmp_path / "warned.txt"
    with job(str(log), str(warned)) as say:
        say("one of two")
        for text in ("the organ\nis cut", "a piece is dropped", "a piece is dropped"):
            warnings.warn(text, stacklevel=1)
    assert load_warnings([warned]) == ["the organ is cut", "a piece is dropped"]
    save_warnings(["a piece is dropped", "more"], tmp_path / "other.txt")
    assert load_warnings([warned, tmp_path / "other.txt"]) == ["the organ is cut", "a piece is dropped", "more"]
    with job(str(log), str(warned)):
        pass
    assert load_warnings([warned]) == [] and warned.read_text() == ""


@pytest.mark.parametrize("error", [InputError("liver.msh: node 3 is infinite; repair it."), ZeroDivisionError("oh")])
def test_a_failure_is_the_last_line_of_the_log_after_the_traceback_of_a_fault(tmp_path, error):
    with pytest.raises(SystemExit) as ended, job(tmp_path / "a.log"):
        raise error
    lines = (tmp_path / "a.log").read_text().splitlines()
    foreseen = isinstance(error, InputError)
    assert ended.value.code == 1 and lines[-1].startswith("error: ") and str(error) in lines[-1]
    assert (len(lines) == 1) == foreseen and ("Traceback" in lines[0]) != foreseen


def test_an_edit_of_a_kernel_compiles_again_what_calls_it_and_nothing_else(tmp_path, monkeypatch):
    package = tmp_path / "palpate"
    package.mkdir()
    for name, text in {
        "called": "import numba\n",
        "caller": "import numba\nfrom palpate import between\n",
        "between": "from palpate.called import x\n",
        "other": "import numba\n",
    }.items():
        (package / f"{name}.py").write_text(text)
    monkeypatch.setattr(dependencies, "PACKAGE", package)
    monkeypatch.setattr(dependencies, "KEPT", tmp_path / "digests")

    def stamps() -> list[str]:
        for kept in (dependencies._facts, dependencies._parsed, dependencies._file):
            kept.cache_clear()
        return [dependencies.kernels(package / f"{name}.py") for name in ("called", "caller", "other")]

    before = stamps()
    (package / "between.py").write_text("from palpate.called import x\nNONE = 0\n")
    (package / "called.py").write_text("# a comment\nimport numba\n")
    assert stamps() == before
    (package / "called.py").write_text("import numba\nONE = 1\n")
    assert [new == old for new, old in zip(stamps(), before, strict=True)] == [False, False, True]


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
