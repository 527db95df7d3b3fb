"""Presses of growing depth at each contact, each once."""

import numpy as np
import pytest

from palpate.bodies.contacts import kept_contacts
from palpate.evaluation.law.growing_presses import growing_presses
from palpate.samples.loads import force_of


def test_each_contact_is_pressed_to_each_depth(beam):
    table = growing_presses(beam, 2, [0.02, 0.01], 0.01)
    assert table["contact"].tolist() == np.repeat(kept_contacts(beam, 2), 2).tolist()
    assert table["peak_of_size"].to_numpy() == pytest.approx([0.01, 0.02] * 2, rel=0.05)
    for _, load in table.iterrows():
        normal = beam.fine.normals[int(load["contact"])]
        assert -force_of(load) @ normal == pytest.approx(np.linalg.norm(force_of(load)))


def test_what_the_highest_pressure_ends_is_pressed_once(beam):
    with pytest.warns(UserWarning, match="would exceed a peak pressure of 0.25 of Young"):
        table = growing_presses(beam, 1, [0.01, 0.03, 0.04], 0.004)
    assert table["capped"].tolist() == ["pressure"] and table["pressure_of_young"].to_numpy() == pytest.approx([0.25])
