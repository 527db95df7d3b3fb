"""Every model of touches that is registered can be loaded."""

import pytest

from palpate.benchmark.touch_measure import load_model
from palpate.models.model_registry import TOUCH_MODELS


@pytest.mark.parametrize("name", TOUCH_MODELS)
def test_a_registered_model_has_what_is_measured(name):
    model = load_model(*TOUCH_MODELS[name])
    assert callable(model.settings) and callable(model.online) and model.LAW
