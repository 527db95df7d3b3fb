"""Names lead to models, are told when they do not, and import nothing before they are asked for."""

import subprocess
import sys

import pytest

from palpate.errors import InputError
from palpate.models import model_registry
from palpate.models.coarse_answers import COARSE_ANSWERS

MEASURE = """
import palpate.benchmark.judge, palpate.benchmark.measure
from palpate.models.load_model import load_model
load_model('fem_p1', 'palpate.models.fem', {'order': 1})
"""


@pytest.mark.parametrize(
    ("code", "absent"),
    [
        ("import palpate.models.model_registry", ("numba", "scipy")),
        (MEASURE, ("palpate.models.model_registry", "palpate.models.enrichment.methods")),
    ],
)
def test_names_alone_import_no_solver_and_measuring_a_model_reads_no_registry(code, absent):
    code += f"\nimport sys; print([name for name in {absent} if name in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout == "[]\n"


def test_an_unknown_name_is_told():
    with pytest.raises(InputError, match="linear_fen, which is unknown; did you mean linear_fem"):
        model_registry.model("linear_fen", {})
    assert model_registry.unknown(["mine", "detail_correction"], {"mine": ""}) == ""
    for taken in ("detail_correction", "fem", "truth", "zero"):
        assert f"{taken}, which palpate uses itself" in model_registry.unknown([], {taken: ""})


def test_a_family_is_what_one_module_makes_and_all_that_a_job_needs():
    found = model_registry.families(["fem_p2", "pod_rbf", "fem_p1", "mine"], {"mine": "mine.py"})
    assert found == {
        "fem": {
            "fem_p2": {"place": "palpate.models.fem", "keywords": {"order": 2}},
            "fem_p1": {"place": "palpate.models.fem", "keywords": {"order": 1}},
        },
        "pod_rbf": {"pod_rbf": {"place": "palpate.models.enrichment.pod_rbf", "keywords": {}}},
        "mine": {"mine": {"place": "mine.py", "keywords": {}}},
    }
    beside = model_registry.families(["contact_modes", "cascade"], {})
    assert list(beside["contact_modes"]) == ["contact_modes", "cascade"]  # whose contacts serve it
    assert list(model_registry.families(["fem_p2", "cascade"], {})) == ["fem", "cascade"]


def test_every_family_that_has_settings_stands_in_the_config(grid):
    families = model_registry.families(list(model_registry.MODELS), {})
    modules = {recipe["place"].rpartition(".")[2] for models in families.values() for recipe in models.values()}
    assert set(grid) - {"coarse_answers"} == modules - {"linear_fem", "interpolation"}
    assert list(COARSE_ANSWERS) == grid["coarse_answers"]


def test_what_a_model_is_told_stands_with_it():
    """Models on top of a coarse deformation know no load; those that hold responses of contacts say so."""
    made = {name: model_registry.model(name, {}) for name in model_registry.MODELS}
    assert all(callable(model.settings) and callable(model.offline) for model in made.values())
    unaware = {name for name, model in made.items() if model.sees == "deformation"}
    assert unaware == {"interpolation", "ridge_upsampling", "kernel_ridge_detail", "pod_rbf"} | {
        name for name, family in model_registry.FAMILY_OF.items() if family == "paper_enrichment"
    }
    assert {name for name, model in made.items() if model.prepared} == {
        "linear_fem", "linear_residual", "warped_compliance", "detail_correction", "contact_modes", "cascade",
        "fem_local",
    }  # fmt: skip
    assert {name for name, model in made.items() if not model.reduces} == {
        "fem_p1", "fem_p2", "fem_local", "interpolation",
        "xpbd", "vertex_block_descent", "projective_dynamics", "mujoco", "newton_vbd",
    }  # fmt: skip
    assert all(model.law for model in made.values())
    assert made["pod_rbf"].needs_contacts({"coarse": "linear"}) and not made["pod_rbf"].needs_contacts({})
