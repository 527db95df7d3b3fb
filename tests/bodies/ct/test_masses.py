"""Masses from CT: exact where the density is linear, the organ's own at its rim, the published curve."""

import numpy as np
import pytest
from scipy.ndimage import binary_erosion

from palpate.bodies.ct.image import Image
from palpate.bodies.ct.masses import (
    density,
    node_masses,
    organ_densities,
    raw_densities,
    voxel_mass,
)
from palpate.bodies.make_body import make_body
from palpate.bodies.particles import particles_of
from palpate.bodies.settings import Ct, Sphere
from palpate.errors import InputError

SPACING = np.array([0.002, 0.003, 0.004])


@pytest.fixture
def organ():
    """A block of 0.06 m x 0.06 m x 0.08 m whose CT number rises from 0.04 to 1 along x, y and z, in fat at -100 HU."""
    mask = np.zeros((28, 28, 38), dtype=bool)
    mask[4:24, 4:24, 4:34] = True
    image = Image(np.full(mask.shape, -100.0, dtype=np.float32), np.array([-0.01, 0.02, 0.03]), SPACING)
    x, y, z = np.moveaxis(image.to_world(np.stack(np.indices(mask.shape), axis=-1)), -1, 0)
    image.hu[mask] = (40 + 100 * x + 50 * y + 80 * z)[mask]
    return image, mask


@pytest.fixture
def mesh(organ, box):
    """A box that fills the organ's voxels."""
    image, _ = organ
    found = box([6, 6, 8], [0.06, 0.06, 0.08])
    return type(found)(found.nodes + image.to_world(np.full(3, 3.5)), found.tetrahedra)


def true_density(points):
    return density(40 + points @ [100, 50, 80])


def test_trilinear_is_exact_inside_for_linear_densities(organ):
    image, mask = organ
    points = image.to_world(np.random.default_rng(0).uniform(6, 21, (200, 3)))
    assert organ_densities(points, image, mask) == pytest.approx(true_density(points), rel=1e-6)
    assert raw_densities(points, image, mask) == pytest.approx(true_density(points), rel=1e-6)


def test_the_surface_is_of_the_organ_and_not_of_what_is_beside_it_or_half_in_its_outermost_voxels(organ, mesh):
    image, mask = organ
    surface = mesh.nodes[mesh.surface]
    assert raw_densities(surface, image, mask).mean() < 0.95 * true_density(surface).mean()
    for lower_hu in (0, 70):
        image.hu[mask & ~binary_erosion(mask)] -= lower_hu
        assert organ_densities(surface, image, mask) == pytest.approx(true_density(surface), rel=2e-3)


def test_masses_add_up_to_those_of_the_voxels(organ, mesh):
    image, mask = organ
    densities = organ_densities(mesh.nodes, image, mask)
    masses = node_masses(mesh, densities)
    assert masses.sum() == pytest.approx(mesh.volumes @ densities[mesh.tetrahedra].mean(axis=1), rel=1e-12)
    assert masses.sum() == pytest.approx(voxel_mass(image, mask), rel=1e-3)
    assert (masses > 0).all()


def test_equation_4_by_hand(organ, mesh):
    densities = organ_densities(mesh.nodes, *organ)
    node = 100
    around = [t for t in range(len(mesh.tetrahedra)) if node in mesh.tetrahedra[t]]
    by_hand = sum(mesh.volumes[t] * densities[mesh.tetrahedra[t]].mean() / 4 for t in around)
    assert node_masses(mesh, densities)[node] == pytest.approx(by_hand, rel=1e-12)


def test_an_organ_one_voxel_thin_has_a_density_all_the_same(organ):
    image, mask = organ
    thin = np.zeros_like(mask)
    thin[10, 5:20, 5:20] = True
    points = image.to_world(np.array([[10.0, 12.0, 12.0]]))
    assert organ_densities(points, image, thin) == pytest.approx(true_density(points), rel=1e-6)


def test_what_cannot_be_weighed_is_reported(organ, mesh):
    image, mask = organ
    with pytest.raises(InputError, match="the mask is empty; give one that marks the organ"):
        organ_densities(mesh.nodes, image, np.zeros_like(mask))
    with pytest.raises(InputError, match="nodes far outside the organ; give both in one frame"):
        organ_densities(1e3 * mesh.nodes, image, mask)


BACK = Sphere(center_m=[-0.1, -0.015, 0.04], radius_m=0.04)
ENTRY = Ct(refinements=1, young_pa=3000, poisson=0.3, density_kg_m3=900, anchors=BACK)


@pytest.fixture(scope="module")
def body():
    return make_body("abdomen", ENTRY)


@pytest.mark.slow
def test_uniform_masses_and_those_of_an_mri_are_of_the_given_density(body):
    volume = body.coarse.volumes.sum()
    uniform, mri = ENTRY.but(masses="uniform", refinements=0), {"modality": "mri", "threshold": [400, 600]}
    uniform, of_mri = (make_body("abdomen", entry) for entry in (uniform, ENTRY.but(refinements=0, **mri)))
    assert uniform.densities is of_mri.densities is None
    assert particles_of(uniform, 0, surface=False).masses.sum() == pytest.approx(900 * volume)


@pytest.mark.slow
def test_a_region_with_a_density_of_its_own_needs_uniform_masses():
    regions = {"lesion": {"label": 2, "young_pa": 30000, "density_kg_m3": 1100}}
    with pytest.raises(InputError, match=r"regions\.lesion has a density_kg_m3, .*or give masses: uniform\.$"):
        make_body("abdomen", ENTRY.but(regions=regions, refinements=0))


@pytest.mark.parametrize(
    ("hu", "g_cm3"),
    [
        (-1000, 0.00121),  # air
        (-50, 1.018 - 0.893e-3 * 50),  # adipose tissue
        (0, 1.018),
        (18, 1.03),
        (60, 1.003 + 1.169e-3 * 60),  # soft tissue
        (800, 1.017 + 0.592e-3 * 800),  # bone
    ],
)
def test_schneiders_lines(hu, g_cm3):
    assert density(hu) == pytest.approx(1e3 * g_cm3, rel=1e-12)


def test_it_jumps_nowhere_but_at_the_end_of_soft_tissue():
    hu = np.arange(-1024, 3072)
    steps = np.diff(density(hu))
    assert (hu[:-1][np.abs(steps) > 2] == 100).all()
    assert steps[hu[:-1] == 100] == pytest.approx(-43.0, abs=0.2)
    assert (density([-3024, -2000, -1000]) == density(-1000)).all()
