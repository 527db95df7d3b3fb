"""Every model has a label, a colour and a marker, the user's own included; numbers stand in sentences."""

from palpate.models.model_registry import FAMILY_OF, MODELS, RESERVED
from palpate.report.model_looks import look, minor


def test_every_model_of_palpates_has_a_look_of_its_own():
    names = [name for name in (*MODELS, *RESERVED) if not minor(name)]
    assert len({(look(name).colour, look(name).marker) for name in names}) == len(names)
    assert {name for name in MODELS if minor(name)} == {
        name for name, family in FAMILY_OF.items() if family == "paper_enrichment"
    }
