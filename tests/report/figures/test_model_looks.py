"""Every model has a label, a colour and a marker, the user's own included."""

from palpate.models.model_registry import FAMILY_OF, MODELS, RESERVED
from palpate.report.model_looks import label, look, minor


def test_own_models_have_a_look_too():
    assert look("my_model") == look("my_model") and look("my_model").label == "my model"
    assert label("my_model", "size=3") == "my model (size=3)" and label("my_model", "default") == "my model"


def test_every_model_of_palpates_has_a_look_of_its_own():
    names = [name for name in (*MODELS, *RESERVED) if not minor(name)]
    assert len({(look(name).colour, look(name).marker) for name in names}) == len(names)
    assert {name for name in MODELS if minor(name)} == {
        name for name, family in FAMILY_OF.items() if family == "paper_enrichment"
    }
