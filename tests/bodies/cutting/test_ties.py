"""Nodes that are tied until a blade passes are those that are one where the blade has come so far."""

import numpy as np
import pytest
from fixtures.bodies import LIVER
from fixtures.cut_cases import slab

from palpate.bodies.cutting.cut import make_cut
from palpate.bodies.cutting.settings import Cut, Stroke
from palpate.bodies.cutting.ties import cut_particles
from palpate.bodies.cutting.ways import SPLIT_FACES, part
from palpate.bodies.make_body import make_body
from palpate.bodies.mesh import TetMesh
from palpate.bodies.particles import particles_of
from palpate.errors import InputError

DOWN = {"depth_m": 0.04, "direction": [0.0, 0.0, -1.0]}
ALONG = Cut(path_m=[[-0.02, -0.05, 0.06], [0.03, 0.0, 0.06], [0.03, 0.05, 0.06]], at_s=0.2, lasts_s=0.5, **DOWN)
ACROSS = Stroke(path_m=[[-0.05, 0.02, 0.06], [0.06, 0.02, 0.06]], at_s=0.6, **DOWN)


def plane(x=0.0, **more):
    return Cut(plane={"point_m": [x, 0.0, 0.0], "normal": [1, 0, 0]}, **more)


@pytest.fixture(scope="module")
def liver():
    return make_body("liver", LIVER.but(refinements=1))


def same_nodes(first: np.ndarray, second: np.ndarray) -> bool:
    """Whether two numberings (m, 4) of corners are one, up to names."""
    both = np.unique(np.column_stack([first.ravel(), second.ravel()]), axis=0)
    return len(both) == len(np.unique(first)) == len(np.unique(second))


@pytest.mark.parametrize(
    "more", [None, pytest.param([ACROSS], marks=pytest.mark.slow)], ids=["one cut", "two that cross"]
)
def test_at_any_time_what_is_one_is_what_a_blade_that_stands_still_there_has_left(liver, more):
    particles = cut_particles("scene", liver, 1, ALONG.but(way=SPLIT_FACES, more=more))
    blades = [make_cut("cut", entry, liver.fine) for entry in (ALONG, *(more or []))]
    counts = []
    for t in (0.1, 0.2, 0.35, 0.5, 0.59, 0.65, 0.8):
        share = np.clip((t - ALONG.at_s) / ALONG.lasts_s, 0.0, 1.0)
        reached = [blades[0].up_to(share * blades[0].length_m if share < 1.0 else np.inf)]
        reached += [blade for blade, entry in zip(blades[1:], more or [], strict=True) if entry.at_s <= t]
        leaders = particles.ties.leaders(t)
        stands = part(liver, 1, reached, SPLIT_FACES)
        assert same_nodes(leaders[particles.tetrahedra], stands.mesh.tetrahedra)
        surface = particles.ties.surface(leaders)
        assert len(surface) == len(stands.mesh.triangles)
        assert TetMesh(particles.nodes, leaders[particles.tetrahedra]).triangles.shape == surface.shape
        counts.append(len(stands.origin))
    assert counts[0] == len(liver.levels[1].nodes) and counts[-1] == len(particles.nodes)
    assert len(set(counts)) >= 5


@pytest.mark.parametrize("more", [None, [ACROSS]], ids=["one cut", "two that cross"])
def test_a_mesh_that_conforms_opens_along_the_blade_as_far_as_it_has_come(liver, more):
    particles = cut_particles("scene", liver, 1, ALONG.but(way="conform", more=more))
    assert np.isfinite(particles.ties.let_go_s).all()
    assert np.array_equal(particles.ties.leaders(0.7), np.arange(len(particles.nodes)))
    blade = make_cut("cut", ALONG, liver.fine)
    for t in (0.1, 0.35, 0.45, 0.55):
        leaders = particles.ties.leaders(t)
        opened = np.flatnonzero(np.bincount(leaders, minlength=len(leaders))[leaders] == 1)
        opened = opened[np.isin(opened, particles.ties.pairs)]
        assert (len(opened) > 0) == (t > 0.3)
        # the patch bends to single nodes by up to an eighth of an edge
        assert np.abs(blade.across(particles.nodes[opened])).max(initial=0.0) < 2e-3
        # no lip is open more than a triangle before the blade
        assert blade.share(particles.nodes[opened]).max(initial=0.0) < max(0.0, (t - 0.2) / 0.5) + 0.15
        assert (
            TetMesh(particles.nodes, leaders[particles.tetrahedra]).triangles.shape
            == particles.ties.surface(leaders).shape
        )


@pytest.mark.parametrize("more", [None, [ACROSS]], ids=["one cut", "two that cross"])
def test_virtual_nodes_are_one_before_the_blade_and_none_is_after(liver, more):
    particles = cut_particles("scene", liver, 1, ALONG.but(way="virtual_nodes", more=more))
    whole = particles_of(liver, 1, surface=False)
    leaders = particles.ties.leaders()
    _, place = np.unique(particles.nodes, axis=0, return_inverse=True)
    assert same_nodes(leaders[:, None], place.reshape(-1, 1))
    assert np.array_equal(particles.ties.leaders(0.7), np.arange(len(particles.nodes)))
    counts = [len(np.unique(particles.ties.leaders(t))) for t in (0.3, 0.4, 0.5, 0.6, 0.7)]
    assert (np.diff(counts) > 0).all()
    assert len(particles.triangles) == len(whole.triangles)
    assert particles.areas.sum() == pytest.approx(whole.areas.sum(), rel=1e-12)
    assert np.bincount(leaders, particles.masses)[np.unique(leaders)].sum() == pytest.approx(whole.masses.sum())


def test_nodes_that_a_cut_hits_within_rounding_are_parted():
    """Every node plane of a regular mesh, and the same a hair beside it."""
    body = slab((4, 4, 2))
    for away in (0.0, 1e-9, -1e-9, 1e-12):
        for way in (SPLIT_FACES, "virtual_nodes"):
            particles = cut_particles("scene", body, 0, plane(0.05 + away, way=way))
            assert len(particles.nodes) == len(body.coarse.nodes) + 15
            assert len(np.unique(particles.ties.leaders())) == len(body.coarse.nodes)
            assert np.array_equal(particles.ties.leaders(0.0), np.arange(len(particles.nodes)))


@pytest.mark.parametrize(
    ("entry", "told"),
    [
        (ALONG.but(path_m=[[0.5, 0.5, 0.5], [0.6, 0.5, 0.5]]), "cut lies outside the body"),
        (ALONG.but(depth_m=0.0), "severs nothing of level 1 of liver"),
        (plane(lasts_s=0.1), "cut.lasts_s is 0.1 s"),
        (ALONG.but(more=[Stroke()]), "cut.more\\[0\\] has none of path_m"),
    ],
)
def test_a_cut_that_is_none_is_refused_in_one_sentence(liver, entry, told):
    with pytest.raises(InputError, match=told):
        cut_particles("scenes.liver", liver, 1, entry.but(way=SPLIT_FACES))
