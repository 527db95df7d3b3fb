"""Contact modes that were exported answer as they do in palpate: at contacts, and between them within their bound."""

from dataclasses import replace

import numpy as np
import pytest
from press.portable.conftest import MODEL

from palpate.benchmark.load import Load
from palpate.bodies.contacts import surface_contacts
from palpate.effects.instrument import Instrument
from palpate.errors import InputError, NotConverged
from palpate.press.portable.export import export_model
from palpate.press.portable.file import read
from palpate.press.portable.touches import Touches


def asked(case, model, node, newtons):
    """What palpate and the file say of a straight press at a fine surface node, and the distance over the peak."""
    force = -newtons * case.body.fine.normals[node]
    right = MODEL.prepare(case).respond(Load.at(node, force)).displacement
    found = model.respond([model.press_at(int(np.searchsorted(case.body.fine.surface, node)), force)])
    apart = np.sqrt(np.mean(np.sum((found.displacement - right) ** 2, axis=1)))
    return found, apart / np.linalg.norm(right, axis=1).max()


@pytest.mark.slow
def test_at_a_contact_the_file_answers_as_the_model_that_it_holds(pressed, exported):
    case, newtons = pressed
    surface = case.body.fine.surface
    for contact in exported.contacts[:3]:
        node = int(surface[np.argmin(np.linalg.norm(case.body.fine.nodes[surface] - contact.place, axis=1))])
        found, apart = asked(case, exported, node, newtons)
        assert apart < 0.005 and found.doubt == ""


@pytest.mark.slow
def test_between_contacts_nine_answers_in_ten_keep_their_bound(pressed, exported):
    case, newtons = pressed
    rng, kept = np.random.default_rng(4), []
    for node in rng.permutation(surface_contacts(case.body)).tolist():
        try:
            found, apart = asked(case, exported, node, newtons)
        except NotConverged:
            continue
        if not found.doubt:
            kept.append(apart <= found.error)
        if len(kept) == 10:
            break
    assert len(kept) == 10 and sum(kept) >= 8
    assert "RMSE over peak" in exported.info["error"]


@pytest.mark.slow
def test_a_file_holds_places_to_touch_with_errors_against_elements(pressed, tmp_path):
    case = pressed[0]
    touches = Touches([Instrument("sphere", 0.02)], 1, 0.2, 1)
    export_model(case, MODEL, 2, tmp_path / "touched.palpate", touches=touches)
    model = read(tmp_path / "touched.palpate")
    (place,) = model.touches
    assert (
        0.0 < place.error < 0.1 and 0.0 < place.force_error < 0.2 and place.deepest_m == pytest.approx(0.004, rel=1e-6)
    )
    answer = model.touch(0, 0.003)
    assert answer.doubt == "" and answer.force_n > 0.0 and answer.force_error == pytest.approx(place.force_error)


def test_what_a_file_cannot_hold_is_refused(pressed, tmp_path):
    case = pressed[0]
    soft = replace(case.body, material=replace(case.body.material, law="neo_hookean"))
    for wrong, said in ((replace(case, body=soft), "law"), (replace(case, radius_m=0.0), "radius")):
        with pytest.raises(InputError, match=said):
            export_model(wrong, MODEL, 4, tmp_path / "none")
    assert list(tmp_path.iterdir()) == []
