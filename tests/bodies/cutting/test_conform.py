"""Meshes conform to a cut, keep their shape and quality, and have lips that are apart and a front that is not."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.bodies import LIVER, lip_pairs
from fixtures.cut_cases import SIZES, TISSUE, slab

from palpate.bodies.body import nest
from palpate.bodies.cutting.conform import cut_body, qualities
from palpate.bodies.cutting.cut import Cuts, Disc, blade
from palpate.bodies.cutting.sever import inner_faces, sever
from palpate.bodies.make_body import make_body
from palpate.bodies.material import Material, Tissue
from palpate.bodies.mesh import area_normals, components, unit
from palpate.bodies.mesh_quality import check_boundary, dihedral_angles
from palpate.bodies.simple_shapes import box, cylinder, sheet
from palpate.errors import InputError

DOWN = np.array([0.0, 0.0, -1.0])


def area_of(cut_mesh, side=0):
    return 0.5 * np.linalg.norm(area_normals(cut_mesh.coarse.nodes, cut_mesh.lips[:, side]), axis=1).sum()


def check_whole(found, body, pieces=1, least_deg=10.0):
    """Nothing of the body is lost or turned over, its skin stays where it was, and lips lie on their sides."""
    mesh, cut = found.coarse, found.cut
    assert mesh.volumes.min() > 0.0
    assert mesh.volumes.sum() == pytest.approx(body.coarse.volumes.sum(), rel=1e-12)
    assert dihedral_angles(mesh).min() > least_deg
    check_boundary("cut", mesh)
    assert components(mesh.edges, len(mesh.nodes)).max() + 1 == pieces
    assert np.array_equal(mesh.nodes, found.whole.nodes[found.origin])
    assert np.allclose(mesh.nodes[found.lips[:, 0]], mesh.nodes[found.lips[:, 1]], rtol=0.0, atol=0.0)
    skin = 0.5 * np.linalg.norm(area_normals(found.whole.nodes, found.whole.triangles), axis=1).sum()
    before = 0.5 * np.linalg.norm(area_normals(body.coarse.nodes, body.coarse.triangles), axis=1).sum()
    assert skin == pytest.approx(before, rel=1e-12)
    # the outward side of the positive lip is the negative one
    normals, middles = area_normals(mesh.nodes, found.lips[:, 0]), mesh.nodes[found.lips[:, 0]].mean(axis=1)
    step = 1e-6 * unit(normals)
    assert (cut.across(middles + step) < cut.across(middles - step)).all()
    lipped = {tuple(each) for each in np.sort(found.lips.reshape(-1, 3), axis=1)}
    assert lipped <= {tuple(each) for each in np.sort(mesh.triangles, axis=1)}
    return mesh


PATHS = {
    "within 1e-9 of nodes": [[0.025, 0.05 + 1e-9, 0.04], [0.075, 0.05 - 1e-9, 0.04]],
    "oblique": [[0.031, 0.0523, 0.04], [0.0672, 0.0416, 0.04]],
}


@pytest.mark.parametrize(
    "name", ["oblique", *(pytest.param(name, marks=pytest.mark.slow) for name in PATHS if name != "oblique")]
)
def test_a_blade_leaves_half_an_ellipse_of_faces(name):
    body, path = slab(), np.array(PATHS[name])
    cut = blade(body.coarse, path, DOWN, 0.012)
    found = cut_body(body, cut, 0.008, 0.004)
    check_whole(found, body)
    ellipse = np.pi / 4.0 * 0.012 * np.linalg.norm(path[1] - path[0])
    assert area_of(found) == pytest.approx(ellipse, rel=0.01)
    assert np.abs(cut.across(found.coarse.nodes[found.lips[:, 0]].reshape(-1, 3))).max() < 1e-9
    front = found.coarse.nodes[found.front]
    assert np.abs(cut.within(front.reshape(-1, 3))).max() < 1e-9
    assert np.linalg.norm(front[:, 1] - front[:, 0], axis=1).max() < 0.005
    # half an ellipse has ends on the skin, where its lips have as many nodes as the mouth
    ends, count = np.unique(found.front, return_counts=True)
    assert np.isin(found.origin[ends[count == 1]], found.whole.surface).all() and (count == 1).sum() == 2
    assert not np.isin(lip_pairs(found), found.front).any()
    first = lip_pairs(found)[:, 0]
    mouth = found.coarse.nodes[first[np.isin(found.origin[first], found.whole.surface)]]
    assert np.allclose(mouth[:, 2], 0.04) and len(mouth) >= 8


@pytest.mark.slow
def test_a_bent_path_has_faces_on_both_planes_and_edges_at_its_kink():
    body = slab()
    cut = blade(body.coarse, np.array([[0.03, 0.05, 0.04], [0.05, 0.047, 0.04], [0.067, 0.0616, 0.04]]), DOWN, 0.012)
    found = cut_body(body, cut, 0.008, 0.004)
    check_whole(found, body)
    on = np.stack([np.abs(p.across(found.coarse.nodes[found.lips[:, 0]].reshape(-1, 3))) for p in cut.pieces])
    assert (on.reshape(2, -1, 3).max(axis=2) < 1e-9).any(axis=0).all()
    assert area_of(found) == pytest.approx(np.pi / 4.0 * 0.012 * cut.length_m, rel=0.01)


@pytest.mark.slow
def test_a_blade_that_leaves_the_body_and_one_that_stops_midway():
    body = slab()
    cut = blade(body.coarse, np.array([[0.0, 0.0523, 0.04], [0.1, 0.047, 0.04]]), DOWN, 0.012)
    assert cut.open_ends == (True, True)
    assert area_of(cut_body(body, cut, 0.012)) == pytest.approx(0.012 * cut.length_m, rel=1e-9)
    midway = cut_body(body, cut.up_to(0.06), 0.012)
    check_whole(midway, body)
    assert area_of(midway) == pytest.approx(0.012 * 0.06, rel=0.03)  # a face in the corner stays joined


def test_cuts_that_cross_leave_four_corners():
    body = slab()
    paths = ([[0.03, 0.05, 0.04], [0.07, 0.05, 0.04]], [[0.03, 0.04, 0.04], [0.07, 0.06, 0.04]])
    first, second = (blade(body.coarse, np.array(path), DOWN, 0.012) for path in paths)
    found = cut_body(body, Cuts((first, second)), 0.01, 0.006)
    assert found.coarse.volumes.sum() == pytest.approx(np.prod(SIZES), rel=1e-12)
    assert dihedral_angles(found.coarse).min() > 4.0
    check_boundary("cuts", found.coarse)
    assert area_of(found) == pytest.approx(np.pi / 4.0 * 0.012 * (first.length_m + second.length_m), rel=0.01)
    copies = np.bincount(found.origin)
    crossing = found.whole.nodes[copies == 4]
    assert len(crossing) >= 2 and np.allclose(crossing[:, :2], 0.05, atol=1e-9)
    assert copies.max() == 4


@pytest.mark.slow
def test_random_cuts_of_the_liver_leave_good_elements():
    """Anywhere on the skin, also through what is held, straight and bent, 4 to 30 mm deep."""
    body, rng = make_body("liver", LIVER), np.random.default_rng(5)
    base, nodes = body.up_to(0), body.fine.nodes[body.fine.surface]
    for number in range(2):
        start = nodes[rng.integers(len(nodes))]
        near = nodes[np.linalg.norm(nodes - start, axis=1) < rng.uniform(0.01, 0.05)]
        far = near[np.linalg.norm(near - start, axis=1).argmax()]
        path = [start, far] if number % 3 else [start, 0.5 * (start + far) + 0.003 * rng.standard_normal(3), far]
        normal = -body.fine.normals[np.linalg.norm(body.fine.nodes - start, axis=1).argmin()]
        try:
            cut = blade(body.fine, np.array(path), normal, rng.uniform(0.004, 0.03))
        except InputError:
            continue
        found = cut_body(body, cut, 0.016, 0.008)
        check_whole(found, base, components(found.coarse.edges, len(found.coarse.nodes)).max() + 1, least_deg=1.0)
        assert qualities(found.coarse.nodes[found.coarse.tetrahedra]).min() > 0.005
        held = found.coarse.nodes[found.anchors[0]]
        assert np.linalg.norm(held - [-0.03, 0.05, 0.03], axis=1).max() <= 0.04 + 1e-12


def test_regions_densities_and_anchors_stay_where_they_are():
    mesh = box(SIZES, [8, 8, 4])
    region = (mesh.nodes[mesh.tetrahedra].mean(axis=1)[:, 0] > 0.05).astype(int)
    tissue = Tissue([TISSUE, Material(9000.0, 0.3, 1000.0)], region)
    body = nest("slab", mesh, 0, np.flatnonzero(mesh.nodes[:, 1] == 0.0), TISSUE, regions=tissue)
    body = replace(body, densities=[1000.0 + 1e4 * mesh.nodes[:, 0]])
    found = cut_body(body, blade(mesh, np.array([[0.04, 0.0, 0.04], [0.065, 0.05, 0.04]]), DOWN, 0.012), 0.012)
    cut = found.coarse
    hard = found.tissue(0).region == 1
    assert cut.volumes[hard].sum() == pytest.approx(0.5 * np.prod(SIZES), rel=0.02)  # nodes may move across its side
    assert np.abs(found.densities[0] - 1000.0 - 1e4 * cut.nodes[:, 0]).max() < 40.0
    assert np.array_equal(found.anchors[0], np.flatnonzero(cut.nodes[:, 1] == 0.0))


def test_a_sheet_is_refused():
    flat = sheet([0.1, 0.1], [4, 4], 0.001)
    with pytest.raises(InputError):
        cut_body(nest("sheet", flat, 0, np.array([0]), TISSUE), Disc(np.full(3, 0.05), DOWN, 0.02), 0.02)


def test_any_faces_can_be_severed():
    """All faces of a mesh: every element is then alone; of one plane: the cylinder is in two, node by node."""
    mesh = cylinder(0.2, 0.03)
    faces, elements = inner_faces(mesh)
    alone = sever(mesh, faces, elements, np.ones(len(faces), dtype=bool))
    assert len(alone.mesh.nodes) == mesh.tetrahedra.size
    height = mesh.nodes[:, 2]
    level = np.unique(height.round(12))[5]
    plane = np.abs(height[faces] - level).max(axis=1) < 1e-9
    halves = sever(mesh, faces, elements, plane)
    assert len(halves.mesh.nodes) - len(mesh.nodes) == (np.abs(height - level) < 1e-9).sum()
    assert components(halves.mesh.edges, len(halves.mesh.nodes)).max() == 1
    none = sever(mesh, faces, elements, np.zeros(len(faces), dtype=bool))
    assert np.array_equal(none.mesh.tetrahedra, mesh.tetrahedra)
