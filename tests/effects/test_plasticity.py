"""Which elastic effects can flow."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from palpate.bodies.particles import particles_of
from palpate.effects import linear_elements
from palpate.effects.fem_plasticity import FemPlasticity
from palpate.effects.plasticity import make
from palpate.errors import InputError

SETTINGS = {"yield_strain": 0.05, "creep_1_s": 10.0, "max_strain": 0.5}


def test_finite_elements_flow_and_springs_do_not(slab):
    particles = particles_of(slab, 0, False)
    elastic = linear_elements.make(particles, {}, None)
    assert isinstance(make(particles, SETTINGS, elastic), FemPlasticity)
    rubber = linear_elements.make(replace(particles, material=replace(particles.material, law="neo_hookean")), {})
    for other in (SimpleNamespace(couples=None), rubber):
        with pytest.raises(InputError, match="not offered for springs, triangles and other laws"):
            make(particles, SETTINGS, other)
