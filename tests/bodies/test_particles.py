"""Particles of bodies with regions, and of several bodies of different materials."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.bodies.body import nest
from palpate.bodies.material import Material, Tissue
from palpate.bodies.particles import default_stiffness, merge_particles, particles_of
from palpate.bodies.simple_shapes import box, sheet
from palpate.effects import shape_matching
from palpate.effects.linear_elements import LinearElements
from palpate.effects.springs import volume_springs
from palpate.errors import InputError

SOFT, HARD = Material(1e3, 0.3, 1000.0), Material(1e5, 0.4, 2000.0)
APART = [[0.0, 0.0, 0.0], [0.0, 0.0, 0.3]]


def solid(material, regions=None):
    return nest("block", box([0.1, 0.1, 0.2], [2, 2, 4]), 1, np.arange(9), material, regions=regions)


def block(material, regions=None, level: int = 0):
    return particles_of(solid(material, regions), level, surface=False)


@pytest.fixture
def layered():
    """A block whose upper half is hard and twice as heavy."""
    mesh = box([0.1, 0.1, 0.2], [2, 2, 4])
    upper = mesh.nodes[mesh.tetrahedra].mean(axis=1)[:, 2] > 0.1
    return Tissue((SOFT, HARD), upper.astype(int))


def test_masses_follow_from_densities_at_nodes(layered):
    """Linear in height, so that the total is exact on any mesh, whatever the materials' densities are."""
    body = solid(SOFT, layered)
    body = replace(body, densities=[1000.0 + 1e4 * level.nodes[:, 2] for level in body.levels])
    for level in (0, 1):
        particles = particles_of(body, level, surface=False)
        assert particles.masses.sum() == pytest.approx(2e-3 * 2000.0)
        assert (particles.masses @ particles.nodes)[2] / 4.0 == pytest.approx(0.1 + 1e4 * 0.2**2 / 12 / 2000, rel=0.1)
        skin = particles_of(replace(body, regions=None), level, surface=True)
        assert skin.masses.sum() == pytest.approx(4.0)


@pytest.mark.parametrize("level", [0, 1])
def test_masses_follow_from_the_density_of_each_element(layered, level):
    particles = block(SOFT, layered, level)
    assert particles.masses.sum() == pytest.approx(1e-3 * 1000 + 1e-3 * 2000)
    height = particles.nodes[:, 2]
    assert particles.masses[height > 0.151].sum() == pytest.approx(2 * particles.masses[height < 0.049].sum())
    assert np.array_equal(particles.tissue.density_kg_m3 == 2000, particles.tissue.young_pa == 1e5)


def test_bodies_of_different_materials_are_one_set_of_particles(layered):
    parts = [block(HARD), block(SOFT, layered), block(SOFT)]
    merged = merge_particles(parts, [*APART, [0, 0, 0.6]], "scene")
    assert np.array_equal(merged.tissue.young_pa, np.concatenate([part.tissue.young_pa for part in parts]))
    assert np.array_equal(merged.tissue.lame_pa, np.concatenate([part.tissue.lame_pa for part in parts]))
    assert merged.tissue.materials == (HARD, SOFT)
    alike = merge_particles([block(SOFT)] * 2, APART, "scene")
    assert alike.regions is None and alike.tissue.materials == (SOFT,)
    # each body keeps its own forces
    rng = np.random.default_rng(3)
    moves = [1e-3 * rng.normal(size=part.nodes.shape) for part in parts]
    together = LinearElements(merged, merged.tissue).force(merged.nodes + np.concatenate(moves))
    alone = [LinearElements(p, p.tissue).force(p.nodes + move) for p, move in zip(parts, moves, strict=True)]
    assert np.abs(together - np.concatenate(alone)).max() < 1e-9 * np.abs(together).max()


def test_the_modulus_of_a_node_is_the_mean_around_it(layered):
    young, height = block(SOFT, layered).nodal_young_pa(), block(SOFT).nodes[:, 2]
    assert np.unique(young[height < 0.09]) == pytest.approx(1e3) and np.unique(young[height > 0.11]) == pytest.approx(
        1e5
    )
    between = young[np.isclose(height, 0.1)]
    assert (between > 1e3).all() and between.mean() == pytest.approx(5.05e4, rel=0.2)
    assert (block(HARD).nodal_young_pa() == 1e5).all()


def test_springs_and_shapes_refuse_several_stiffnesses(layered):
    particles = block(SOFT, layered)
    shapes = {"mode": "linear", "alpha": 1.0, "beta": 0.5, "clusters": {"kind": "one"}}
    calls = {
        "springs have": lambda p: volume_springs(p),
        "a stiffness that follows from Young's modulus needs": lambda p: default_stiffness(p),
        "shape matching has": lambda p: shape_matching.make(p, shapes),
    }
    heavy = merge_particles([block(SOFT), block(replace(SOFT, density_kg_m3=3000.0))], APART, "scene")
    for what, call in calls.items():
        with pytest.raises(
            InputError, match=rf"^block: {what} one stiffness only, and its tetrahedra have several; choos"
        ):
            call(particles)
        if "shape" not in what:
            call(heavy)  # of two densities


def test_a_surface_of_a_body_with_regions_is_refused(layered):
    with pytest.raises(InputError, match=r"^scene of block: a surface has no inside that could have regions"):
        particles_of(solid(SOFT, layered), 0, surface=True)


def test_sheets_surfaces_and_laws_must_be_alike():
    cloth = [nest("cloth", sheet([0.1, 0.1], [2, 2], t), 0, np.arange(3), m) for t, m in ((1e-3, SOFT), (1e-3, HARD))]
    sheets = [particles_of(body, 0, surface=False) for body in cloth]
    with pytest.raises(InputError, match=r"^scene: cloth has young_pa 1000 and cloth 100000; sheets and"):
        merge_particles(sheets, APART, "scene")
    with pytest.raises(InputError, match=r"^scene: block has thickness_m 0 and cloth 0\.001; "):
        merge_particles([block(SOFT), sheets[0]], APART, "scene")
    other = replace(SOFT, law="neo_hookean")
    with pytest.raises(InputError, match=r"^scene: block has law corotational and block neo_hookean; bodies"):
        merge_particles([block(SOFT), block(other)], APART, "scene")
