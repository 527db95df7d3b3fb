"""Removed, split and doubled elements: volumes, pieces and sides, wherever a cut lies in the mesh."""

import numpy as np
import pytest
from fixtures.bodies import LIVER
from fixtures.cut_cases import TISSUE, plane, random_cuts, slab, smallest_pivot
from scipy import sparse

from palpate.bodies.body import nest
from palpate.bodies.cutting.cut import blade
from palpate.bodies.cutting.ways import LEAST_SHARE, REMOVAL, SPLIT_FACES, VIRTUAL_NODES, WAYS, part
from palpate.bodies.make_body import make_body
from palpate.bodies.mesh import components, unit
from palpate.bodies.simple_shapes import box
from palpate.models.fem_statics import to_surface

COUNT = 3
"""Random cuts of the liver."""


def side_of(cuts, points):
    return np.column_stack([np.where(cut.across(points) >= 0.0, 1, -1) for cut in cuts])


def filled(found):
    return found.mesh.volumes * found.body.regions.share


def pieces(found):
    return components(found.mesh.edges, len(found.mesh.nodes))


def volumes_of_pieces(found):
    return np.bincount(pieces(found)[found.mesh.tetrahedra[:, 0]], filled(found))


def longest_edge(mesh):
    ends = mesh.nodes[mesh.edges]
    return np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).max()


def check(found, body, level, cuts, way):
    """No element is inverted, tissue is where it was or lost, and points are told by elements of their own side."""
    assert found.mesh.volumes.min() > 0.0
    assert np.array_equal(found.mesh.nodes, found.whole.nodes[found.origin])
    share = filled(found).sum() / found.whole.volumes.sum()
    assert share == pytest.approx(1.0 - found.lost_share, rel=1e-12)
    rows, points = to_surface(body, level), body.fine.nodes[body.fine.surface]
    sides = side_of(cuts, points)
    up = found.interpolation(rows, sides)
    assert np.allclose(up @ found.mesh.nodes, rows @ body.levels[level].nodes, rtol=0.0, atol=1e-12)
    if way == VIRTUAL_NODES:
        # where a cut goes through the whole body, nodes of the other side only have no say
        for c in np.flatnonzero([(cut.within(points) > 0.0).all() for cut in cuts]):
            for side in (1, -1):
                own = np.unique(found.mesh.tetrahedra[found.sides[:, c] * side >= 0])
                deep = cuts[c].across(points) * side > 0.1 * longest_edge(found.mesh)
                others = np.setdiff1d(np.arange(len(found.origin)), own)
                assert not sparse.csr_array(up)[deep][:, others].count_nonzero()


@pytest.mark.parametrize("shift", [0.0, -1e-9, 0.0031])
@pytest.mark.parametrize("way", WAYS)
def test_a_plane_leaves_two_pieces(way, shift):
    body = slab()
    cuts = [plane([0.05 + shift, 0.0, 0.0], [1.0, 0.0, 0.0])]
    found = part(body, 0, cuts, way)
    check(found, body, 0, cuts, way)
    volumes = np.sort(volumes_of_pieces(found))
    halves = np.sort([0.05 + shift, 0.05 - shift]) * 0.1 * 0.04
    if way == VIRTUAL_NODES or abs(shift) < 1e-6:
        assert volumes == pytest.approx(halves, rel=1e-6)
        assert found.lost_share == pytest.approx(0.0, abs=1e-12)
    elif way == SPLIT_FACES:
        assert volumes.sum() == pytest.approx(halves.sum(), rel=1e-12)
        assert len(volumes) == 2
    else:  # one layer of elements, an eighth, is crossed, of which those remain that only corners are cut off
        assert len(volumes) >= 2
        assert 0.05 < found.lost_share <= 0.125 + 1e-9


def test_the_part_of_an_element_is_that_of_its_volume():
    body = slab((1, 1, 1))
    found = part(body, 0, [plane([0.03, 0.0, 0.0], [1.0, 0.3, 0.5])], VIRTUAL_NODES)
    points = np.random.default_rng(0).dirichlet(np.ones(4), 100_000)
    for parent, side, share in zip(found.parents, found.sides[:, 0], found.body.regions.share, strict=True):
        inside = points @ found.whole.nodes[found.whole.tetrahedra[parent]]
        across = (inside - [0.03, 0.0, 0.0]) @ unit([1.0, 0.3, 0.5])
        if side:
            assert share == pytest.approx(np.mean(across * side >= 0.0), abs=0.01)


@pytest.mark.parametrize("way", WAYS)
def test_lips_of_a_blade_are_apart_and_its_front_is_not(way):
    body = slab((16, 16, 8))
    path = np.array([[0.0213, 0.0512, 0.04], [0.0787, 0.0488, 0.04]])
    cuts = [blade(body.coarse, path, -np.eye(3)[2], 0.015)]
    found = part(body, 0, cuts, way)
    check(found, body, 0, cuts, way)
    assert pieces(found).max() == 0
    copied = np.flatnonzero(np.bincount(found.origin, minlength=len(found.whole.nodes)) > 1)
    if way == SPLIT_FACES:  # the doubled part of the mesh is about as deep and long as the cut
        low, high = found.whole.nodes[copied].min(axis=0), found.whole.nodes[copied].max(axis=0)
        assert 0.04 - low[2] == pytest.approx(0.0125, abs=0.006)
        # one edge of 6.25 mm more on either side is the front's
        assert 0.035 < high[0] - low[0] < 0.0576


@pytest.mark.parametrize("way", WAYS)
def test_slices_of_elements_keep_a_stiffness(way):
    """A copy has LEAST_SHARE of its element at least, and so has the smallest pivot of the one before, within a ten."""
    body = slab()
    before, softest = smallest_pivot(body), []
    for share in (0.5, 1.01, 2.0, 10.0, 100.0):  # thirds of it are the distance from a layer of faces, over a cell
        cut = plane([0.05 + share * LEAST_SHARE / 3.0 * 0.0125, 0.0, 0.0], [1.0, 0.0, 0.0])
        softest.append(smallest_pivot(part(body, 0, [cut], way).body) / before)
    assert min(softest) > (0.1 * LEAST_SHARE if way == VIRTUAL_NODES else 0.1)
    assert softest[0] > 0.1


@pytest.mark.parametrize("near", [0.0, 1e-9])
@pytest.mark.parametrize("way", WAYS)
def test_a_lip_is_held_on_its_own_side_only(way, near):
    """A plane that meets what is held leaves it to both halves; one within the held layer leaves the rest to no one."""
    mesh = box([0.1, 0.1, 0.04], [8, 8, 4])
    body = nest("slab", mesh, 0, np.flatnonzero(mesh.nodes[:, 0] == 0.0), TISSUE)
    across = part(body, 0, [plane([0.05, 0.05 + near, 0.02], [0.0, 1.0, 0.0])], way)
    assert len(across.body.anchors[0]) == 50
    along = part(body, 0, [plane([0.6 * 0.0125 + near, 0.0, 0.0], [1.0, 0.0, 0.0])], way)
    free = pieces(along) == pieces(along)[along.mesh.nodes[:, 0].argmax()]
    assert not free[along.body.anchors[0]].any()


@pytest.fixture(scope="module")
def liver():
    return make_body("liver", LIVER)


@pytest.mark.parametrize("seed", range(COUNT))
def test_random_cuts_of_the_liver(liver, seed):
    cuts = random_cuts(liver, seed)
    for level in (0, 1):
        for way in WAYS:
            found = part(liver, level, cuts, way)
            check(found, liver, level, cuts, way)
            if way != REMOVAL:
                assert found.lost_share == pytest.approx(0.0, abs=1e-12)
