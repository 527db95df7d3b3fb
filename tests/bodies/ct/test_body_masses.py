"""A body from a CT moves with the masses of its voxels, unless its entry asks for uniform ones."""

import numpy as np
import pytest

from palpate.bodies.ct.masses import nodal_densities, node_masses
from palpate.bodies.ct.synthetic_abdomen import abdomen
from palpate.bodies.make_body import make_body, moves_with_ct
from palpate.bodies.particles import particles_of
from palpate.errors import InputError

pytest.importorskip("SimpleITK")
ENTRY = {
    "kind": "ct",
    "image": None,
    "threshold_hu": [30, 120],
    "surface_nodes": 140,
    "refinements": 1,
    "young_pa": 3000,
    "poisson": 0.3,
    "density_kg_m3": 900,
    "anchors": {"sphere": {"center_m": [-0.1, -0.015, 0.04], "radius_m": 0.04}},
}


@pytest.fixture(scope="module")
def body():
    return make_body("abdomen", ENTRY)


def test_particles_weigh_what_the_voxels_do(body):
    for level in (0, 1):
        masses = particles_of(body, level, surface=False).masses
        assert masses.sum() == pytest.approx(abdomen()[1]["mass_kg"], rel=0.01)
        densities = nodal_densities(ENTRY, [body.levels[level]])[0]
        assert masses == pytest.approx(node_masses(body.levels[level], densities))
        assert np.ptp(densities) > 1.0


def test_uniform_masses_and_those_of_an_mri_are_of_the_given_density(body):
    volume = body.coarse.volumes.sum()
    for more in ({"masses": "uniform"}, {"masses": "ct", "modality": "mri"}):
        assert not moves_with_ct(ENTRY | more)
    uniform = make_body("abdomen", ENTRY | {"masses": "uniform", "refinements": 0})
    assert uniform.densities is None
    assert particles_of(uniform, 0, surface=False).masses.sum() == pytest.approx(900 * volume)


def test_a_region_with_a_density_of_its_own_needs_uniform_masses():
    regions = {"lesion": {"label": 2, "young_pa": 30000, "density_kg_m3": 1100}}
    with pytest.raises(InputError, match=r"regions\.lesion has a density_kg_m3, .*or give masses: uniform\.$"):
        make_body("abdomen", ENTRY | {"regions": regions, "refinements": 0})
