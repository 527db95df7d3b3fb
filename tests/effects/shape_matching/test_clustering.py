"""Groups of particles that overlap, and hold together what the mesh does."""

from dataclasses import replace

import numpy as np
import pytest

from palpate.bodies.particles import particles_of
from palpate.effects.shape_matching import make_clusters
from palpate.errors import InputError


@pytest.fixture(scope="module")
def volume(slab):
    return particles_of(slab, 1, surface=False)


@pytest.fixture(scope="module")
def surface(slab):
    return particles_of(slab, 1, surface=True)


def groups(clusters):
    return [clusters.members[a:b] for a, b in zip(clusters.starts[:-1], clusters.starts[1:], strict=True)]


def twice(particles):
    """Two of them far apart."""
    count = len(particles.nodes)
    return replace(
        particles,
        nodes=np.concatenate([particles.nodes, particles.nodes + 1.0]),
        masses=np.tile(particles.masses, 2),
        triangles=np.concatenate([particles.triangles, particles.triangles + count]),
        tetrahedra=np.concatenate([particles.tetrahedra, particles.tetrahedra + count]),
    )


def test_one_takes_each_piece_of_a_body(surface):
    found = groups(make_clusters(twice(surface), {"kind": "one"}))
    count = len(surface.nodes)
    assert [g.tolist() for g in found] == [list(range(count)), list(range(count, 2 * count))]


def test_every_tetrahedron_lies_inside_a_cluster(volume):
    clusters = make_clusters(volume, {"kind": "tetrahedra"})
    found = groups(clusters)
    assert 1 < len(found) < len(volume.tetrahedra) / 4
    inside = [np.isin(volume.tetrahedra, group).all(axis=1) for group in found]
    assert np.any(inside, axis=0).all()
    assert clusters.shared_by.max() > 1


def test_to_the_letter_each_tetrahedron_has_a_cluster_of_all_around_it(volume):
    clusters = make_clusters(volume, {"kind": "each_tetrahedron"})
    found = groups(clusters)
    assert len(found) == len(volume.tetrahedra)
    for own, group in zip(volume.tetrahedra, found, strict=True):
        around = volume.tetrahedra[np.isin(volume.tetrahedra, own).any(axis=1)]
        assert set(group) == set(around.ravel())
    covered = {tuple(g) for g in groups(make_clusters(volume, {"kind": "tetrahedra"}))}
    assert covered < {tuple(g) for g in found}


def test_cubes_are_as_small_and_overlap_as_much_as_asked(volume):
    for edge, overlap in ((0.08, 0.5), (0.06, 0.3), (0.5, 0.0)):
        found = groups(make_clusters(volume, {"kind": "cubes", "edge_m": edge, "overlap": overlap}))
        assert all(np.ptp(volume.nodes[g], axis=0).max() <= edge * (1 + 1e-8) for g in found)
        assert np.array_equal(np.unique(np.concatenate(found)), np.arange(len(volume.nodes)))
        assert (len(found) == 1) == (edge == 0.5)


def test_pieces_get_cubes_of_their_own(surface):
    settings = {"kind": "cubes", "edge_m": 0.08, "overlap": 0.5}
    alone, both = (groups(make_clusters(p, settings)) for p in (surface, twice(surface)))
    assert len(both) == 2 * len(alone)
    assert all(np.array_equal(g + len(surface.nodes), h) for g, h in zip(alone, both[len(alone) :], strict=True))


def test_particles_without_a_mesh_are_one_piece(volume):
    none = replace(volume, triangles=np.empty((0, 3), dtype=int), tetrahedra=np.empty((0, 4), dtype=int))
    assert len(groups(make_clusters(none, {"kind": "one"}))) == 1


@pytest.mark.parametrize(
    "settings, says",
    [
        ({"kind": "spheres"}, "kind"),
        ({"kind": "cubes", "edge_m": 0.0, "overlap": 0.5}, "edge_m"),
        ({"kind": "cubes", "edge_m": np.nan, "overlap": 0.5}, "edge_m"),
        ({"kind": "cubes", "edge_m": 0.1, "overlap": 1.0}, "overlap"),
        ({"kind": "cubes", "edge_m": 1e-9, "overlap": 0.5}, "too many cubes"),
        ({"kind": "cubes", "edge_m": 0.026, "overlap": 0.0}, "hold the body together"),
    ],
)
def test_unusable_settings_are_refused(volume, settings, says):
    with pytest.raises(InputError, match=says):
        make_clusters(volume, settings)


def test_tetrahedra_need_tetrahedra_around_every_particle(volume, surface):
    with pytest.raises(InputError, match="use cubes"):
        make_clusters(surface, {"kind": "tetrahedra"})
    spare = replace(volume, nodes=np.vstack([volume.nodes, [[9.0, 9.0, 9.0]]]))
    with pytest.raises(InputError, match="no tetrahedron"):
        make_clusters(spare, {"kind": "tetrahedra"})


def test_cubes_need_an_edge(slab):
    with pytest.raises(InputError, match="lacks edge_m"):
        make_clusters(particles_of(slab, 0, False), {"kind": "cubes", "overlap": 0.5})
