"""Clusters come apart where they are cut, and nowhere else."""

import numpy as np
import pytest
from fixtures.cut_cases import answer

from palpate.bodies.cutting.cut import blade
from palpate.bodies.cutting.ways import SPLIT_FACES, VIRTUAL_NODES, part, whole
from palpate.bodies.mesh import components
from palpate.bodies.particles import particles_of
from palpate.effects.settings import Clusters
from palpate.effects.shape_matching import make_clusters
from palpate.models.shape_matching import CutShapes, split

SETTING = {"level": 1, "mode": "linear", "clusters": "tetrahedra", "steps": 300}


def clusters_of(body, level):
    return make_clusters(particles_of(whole(body, level, 0).body, 0, surface=False), Clusters(kind="tetrahedra"))


@pytest.mark.parametrize("way", [SPLIT_FACES, VIRTUAL_NODES])
def test_severed_shapes_follow_their_hook(severed, way):
    """Within what is left of swings; no cluster is of two pieces."""
    case = severed(0.0537)
    model, shift = CutShapes(case, **SETTING, way=way), case.hooks[0].shift_m
    found = answer(model).displacement
    along = case.body.fine.nodes[case.body.fine.surface][:, 0]
    assert np.abs(found[along < 0.0537]).max() < 1e-9
    assert np.abs(found[along > 0.0537] - shift).max() < 0.01 * np.linalg.norm(shift)
    mesh = model._opened.parted.mesh
    clusters, piece = model._matching.clusters, components(mesh.edges, len(mesh.nodes))
    assert piece.max() == 1
    assert all(np.ptp(piece[own]) == 0 for own in np.split(clusters.members, clusters.starts[1:-1]))


@pytest.mark.parametrize("way", [SPLIT_FACES, VIRTUAL_NODES])
def test_no_cluster_reaches_through_the_cut(opening, way):
    before, parted = clusters_of(opening.body, 1), part(opening.body, 1, opening.cuts, way)
    after = split(before, parted, opening.cuts)
    assert len(after.starts) > len(before.starts)
    assert len(after.shared_by) == len(parted.mesh.nodes) and after.shared_by.all()
    doubled = np.bincount(parted.origin)[parted.origin] > 1
    for first, last in zip(after.starts[:-1], after.starts[1:], strict=True):
        copies = parted.origin[own := after.members[first:last]][doubled[after.members[first:last]]]
        assert len(np.unique(copies)) == len(copies) and len(np.unique(own)) == len(own)


def test_what_the_cut_does_not_reach_stays_as_it_is(slab, opening):
    path = np.array([[0.031, 0.0523, 0.04], [0.0672, 0.0416, 0.04]])
    cuts = [blade(slab.fine, path, np.array([0.0, 0.0, -1.0]), 0.0)]
    before = clusters_of(slab, 1)
    after = split(before, part(slab, 1, cuts, VIRTUAL_NODES), cuts)
    assert np.array_equal(after.members, before.members) and np.array_equal(after.starts, before.starts)


def test_lips_open_along_the_cut(opening):
    wide = answer(CutShapes(opening, **SETTING | {"steps": 40})).opening @ [0.0, 1.0, 0.0]
    assert (wide[1:-1] > 0.0003).all()
