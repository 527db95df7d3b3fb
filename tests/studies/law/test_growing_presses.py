"""Presses of growing depth at each contact, each once."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.benchmark.loads import force_of
from palpate.bodies.contacts import kept_contacts
from palpate.bodies.material import Tissue
from palpate.studies.law.compare_laws import growing_presses


def test_each_contact_is_pressed_to_each_depth(beam):
    table = growing_presses(beam, 2, [0.02, 0.01], 0.01)
    assert table["contact"].tolist() == np.repeat(kept_contacts(beam, 2), 2).tolist()
    assert table["peak_of_size"].to_numpy() == pytest.approx([0.01, 0.02] * 2, rel=0.05)
    for _, load in table.iterrows():
        normal = beam.fine.normals[int(load["contact"])]
        assert -force_of(load) @ normal == pytest.approx(np.linalg.norm(force_of(load)))


def test_a_body_with_regions_is_pressed_above_them(beam):
    far = beam.coarse.nodes[beam.coarse.tetrahedra].mean(axis=1)[:, 0]
    soft, stiff = beam.material, replace(beam.material, young_pa=10 * beam.material.young_pa)
    lump = replace(beam, regions=Tissue((soft, stiff), (far > 0.8 * far.max()).astype(int)))
    table = growing_presses(lump, 0, [0.01, 0.02], 0.01)
    assert table["contact"].nunique() == 1 and len(table) == 2
    assert beam.coarse.nodes[table["contact"].iloc[0], 0] > 0.7 * beam.coarse.nodes[:, 0].max()
    assert growing_presses(lump, 2, [0.01, 0.02], 0.01)["contact"].nunique() == 3


def test_what_the_highest_pressure_ends_is_pressed_once(beam):
    with pytest.warns(UserWarning, match="would exceed a peak pressure of 0.25 of Young"):
        table = growing_presses(beam, 1, [0.01, 0.03, 0.04], 0.004)
    assert table["capped"].tolist() == ["pressure"] and table["pressure_of_young"].to_numpy() == pytest.approx([0.25])
