"""Names lead to models, are told when they do not, and import nothing before they are asked for."""

import subprocess
import sys

import pytest

from palpate.errors import InputError
from palpate.models import model_registry

MEASURE = """
import palpate.benchmark.press_measure
from palpate.studies.tradeoff.jobs import load_model
load_model('fem_p1', 'palpate.models.kinds:FEM', {'order': 1})
"""


@pytest.mark.parametrize(
    ("code", "absent"),
    [
        ("import palpate.models.model_registry", ("numba", "scipy")),
        (MEASURE, ("palpate.models.fast_fem", "palpate.models.enrichment.methods")),
    ],
)
def test_names_alone_import_no_solver_and_a_model_that_is_measured_no_other_one(code, absent):
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
    fem = "palpate.models.kinds:FEM"
    assert found == {
        "fem": {"fem_p2": {"place": fem, "fields": {"order": 2}}, "fem_p1": {"place": fem, "fields": {"order": 1}}},
        "pod_rbf": {"pod_rbf": {"place": "palpate.models.kinds:PODRBF", "fields": {}}},
        "mine": {"mine": {"place": "mine.py", "fields": {}}},
    }
    beside = model_registry.families(["linear_fem", "linear_residual"], {})
    assert list(beside["linear_fem"]) == ["linear_fem", "linear_residual"]  # whose compliance serves it
    assert list(model_registry.families(["fem_p2", "linear_residual"], {})) == ["fem", "linear_residual"]


def test_what_models_are_tried_with_is_named_after_families(grid):
    families = set(map(model_registry.family_of, model_registry.MODELS))
    tried_alike = {
        "linear_fem", "interpolation", "shape_matching", "fem_local", "ridge", "linear_residual", "detail_correction",
        "warped_compliance", "pod_of_loads",
    }  # fmt: skip
    assert set(type(grid).model_fields) - {"coarse_answers"} == families - tried_alike
