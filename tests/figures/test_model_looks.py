"""Every model has a label, a colour and a marker, the user's own included."""

from palpate.figures.model_looks import label, look


def test_own_models_have_a_look_too():
    assert look("my_model") == look("my_model") and look("my_model").label == "my model"
    assert label("my_model", "size=3") == "my model (size=3)" and label("my_model", "default") == "my model"
