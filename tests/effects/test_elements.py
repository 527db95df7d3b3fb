"""Energy and force that are kept: never those of other positions or of other elements."""

import numpy as np
import pytest

from palpate.effects.fem_plasticity import FemPlasticity
from palpate.effects.linear_elements import LinearElements
from palpate.effects.quadratic_elements import QuadraticElements


@pytest.fixture(params=["linear", "quadratic"])
def elements(request, slab, monkeypatch):
    """Elements, positions, and a list that grows with each pass over the elements."""
    linear = request.param == "linear"
    elastic = LinearElements(slab.fine, slab.material) if linear else QuadraticElements(slab.coarse, slab.material)
    passes, evaluate = [], type(elastic).evaluate
    monkeypatch.setattr(type(elastic), "evaluate", lambda self, *a: passes.append(1) or evaluate(self, *a))
    x = slab.fine.nodes + 1e-3 * np.random.default_rng(0).normal(size=slab.fine.nodes.shape)
    return elastic, x, passes


def test_energy_and_force_at_the_same_place_are_one_pass(elements):
    elastic, x, passes = elements
    energy, force, added = elastic.energy(x), elastic.force(x.copy()), np.ones_like(x)
    elastic.add_force(x, None, added)
    assert elastic.energy(x) == energy and len(passes) == 1
    assert np.array_equal(added, 1.0 + force)


def test_the_last_two_places_are_kept(elements):
    elastic, x, passes = elements
    places = [x, x + 1e-4, x + 2e-4]
    found = [(elastic.energy(y), elastic.force(y)) for y in places]
    assert len(passes) == 3
    for y, (energy, force) in list(zip(places, found, strict=True))[::-1]:
        assert elastic.energy(y) == energy and np.array_equal(elastic.force(y), force)
    assert len(passes) == 4


def test_positions_and_forces_changed_in_place_change_nothing_kept(elements):
    elastic, x, _ = elements
    before, kept = elastic.force(x), x.copy()
    energy = elastic.energy(x)
    elastic.force(x)[:] = 7.0
    x *= 1.1
    assert elastic.energy(x) > 2 * energy
    assert np.array_equal(elastic.force(kept), before) and elastic.energy(kept) == energy


def test_plastic_flow_is_seen(slab):
    elastic = LinearElements(slab.fine, slab.material)
    x = slab.fine.nodes * [1.2, 0.9, 0.9]
    before = elastic.energy(x)
    FemPlasticity(elastic, 0.01, 10.0, 0.5).relax(x, 0.1)
    assert elastic.energy(x) < 0.9 * before
