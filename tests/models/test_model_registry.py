"""Names lead to models, are told when they do not, and import nothing before they are asked for."""

import subprocess
import sys

import pytest

from palpate.errors import InputError
from palpate.models import model_registry


@pytest.mark.parametrize("name", model_registry.MODELS)
def test_every_model_has_its_module(name):
    model = model_registry.model(name, {})
    assert callable(model.settings) and callable(model.prepare)


def test_names_alone_import_no_solver():
    code = "import sys, palpate.models.model_registry; print(any(name in sys.modules for name in ('numba', 'scipy')))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout == "False\n"


def test_an_unknown_name_is_told():
    with pytest.raises(InputError, match="linear_fen, which is unknown; did you mean linear_fem"):
        model_registry.model("linear_fen", {})
    assert model_registry.unknown(["mine", "detail_correction"], {"mine": ""}) == ""
    for taken in ("detail_correction", "fem", "reference"):
        assert f"{taken}, which palpate uses itself" in model_registry.unknown([], {taken: ""})


def test_a_family_is_what_one_module_makes():
    found = model_registry.families(["fem_fine", "detail_correction", "fem_coarse", "mine"], {"mine": "mine.py"})
    assert found == {"fem": ["fem_fine", "fem_coarse"], "detail_correction": ["detail_correction"], "mine": ["mine"]}
