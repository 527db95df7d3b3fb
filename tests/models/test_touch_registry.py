"""Every model of touches that is registered can be loaded."""

import pytest

from palpate.benchmark.touch_measure import load_model
from palpate.models.touch.registry import MODELS


@pytest.mark.parametrize("name", MODELS)
def test_a_registered_model_has_what_is_measured(name):
    model = load_model(*MODELS[name])
    assert callable(model.settings) and callable(model.online) and model.LAW
