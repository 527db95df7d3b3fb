"""What a scene's entry says of contact."""

import pytest

from palpate.scenes.contact_settings import has_contact, has_moving_instrument

STILL = {"kind": "floor", "height_m": 0.0}
PUSHED = STILL | {"times_s": [0.5, 1.0], "shifts_m": [[0, 0, 0], [0, 0, 1]]}


@pytest.mark.parametrize(
    ("entry", "acts"),
    [
        ({"effects": "auto"}, False),
        ({"effects": "auto", "contact": {"instruments": []}}, False),
        ({"effects": "auto", "contact": {"instruments": [STILL]}}, True),
        ({"effects": "auto", "contact": {"self_contact": True}}, True),
        ({"effects": "auto", "others": [{"body": "block"}]}, True),
        ({"effects": ["springs"], "others": [{"body": "block"}], "contact": {"instruments": [STILL]}}, False),
        ({"effects": ["springs", "contact"]}, True),
    ],
)
def test_where_contact_acts(entry, acts):
    assert has_contact(entry | {"duration_s": 1.0}) is acts
    assert not has_moving_instrument(entry | {"duration_s": 1.0})


@pytest.mark.parametrize(
    ("tool", "duration", "moves"),
    [
        (PUSHED, 1.0, True),
        (PUSHED, 0.6, True),
        (PUSHED, 0.5, False),
        (PUSHED | {"times_s": [-1.0, 0.0]}, 1.0, False),
        (PUSHED | {"shifts_m": [[0, 0, 1], [0, 0, 1]]}, 1.0, False),
        (PUSHED | {"times_s": [0.0], "shifts_m": [[0, 0, 1]]}, 1.0, False),
    ],
)
def test_what_is_driven_within_the_scene(tool, duration, moves):
    entry = {"duration_s": duration, "contact": {"instruments": [STILL, tool]}}
    assert has_moving_instrument(entry | {"effects": "auto"}) is moves
    assert not has_moving_instrument(entry | {"effects": ["springs"]})
