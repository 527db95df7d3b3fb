"""Held nodes are the anchors, and there must be some."""

import numpy as np
import pytest

from palpate.bodies.body import nest
from palpate.bodies.particles import particles_of
from palpate.effects.held import make
from palpate.errors import InputError


@pytest.mark.parametrize("surface", [False, True])
def test_anchors_are_fixed(slab, surface):
    particles = particles_of(slab, 0, surface)
    assert (particles.nodes[make(particles, {}, None).fixed][:, 0] < 0.03).all()
    assert len(make(particles, {}, None).fixed) == len(slab.anchors[0])


def test_a_body_without_anchors_is_told_so(slab, soft):
    free = nest("free", slab.coarse, 0, np.empty(0, dtype=int), soft)
    with pytest.raises(InputError, match="give the body anchors"):
        make(particles_of(free, 0, False), {}, None)
