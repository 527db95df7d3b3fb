"""Bodies from entries and files, what holds them, and which nodes can be pressed."""

from dataclasses import replace

import numpy as np
import pytest
import skfem
from fixtures.bodies import LIVER
from pydantic import TypeAdapter
from scipy.spatial.distance import cdist, pdist

from palpate.bodies.body import Body, nest
from palpate.bodies.contacts import contacts_of, kept_contacts, pressed_contacts, row_of
from palpate.bodies.make_body import make_body
from palpate.bodies.mesh import TetMesh
from palpate.bodies.mesh_quality import mesh_sizes
from palpate.bodies.refinement import finer
from palpate.bodies.settings import Anchors, Box, Cylinder, Plane, Rule, Sphere
from palpate.bodies.simple_shapes import sheet
from palpate.bodies.supports import Bed, choose_anchors, default_anchors
from palpate.errors import InputError

STUFF = {"young_pa": 3000, "poisson": 0.3, "anchors": Plane(axis="z", side="min", depth_m=0.01)}
CYLINDER = Cylinder(length_m=0.2, radius_m=0.03, refinements=1, **STUFF)
BOX = Box(sizes_m=[0.1, 0.1, 0.3], divisions=[2, 2, 6], refinements=1, **STUFF)


def counts(body):
    table = mesh_sizes(body)
    return table[["surface_nodes", "surface_triangles", "nodes", "tetrahedra"]].to_numpy().tolist()


def check_nesting(body):
    volume = body.coarse.volumes.sum()
    for coarse, fine, prolongation in zip(body.levels, body.levels[1:], body.prolongations, strict=False):
        assert np.array_equal(prolongation @ coarse.nodes, fine.nodes)
        assert np.array_equal(fine.surface[: len(coarse.surface)], coarse.surface)
        assert fine.volumes.min() > 0
        assert fine.volumes.sum() == pytest.approx(volume, rel=1e-12)
    n = len(body.coarse.nodes)
    assert np.array_equal(body.fine.nodes[:n], body.coarse.nodes)
    assert np.array_equal(body.anchors[-1][body.anchors[-1] < n], body.anchors[0])


@pytest.mark.parametrize(
    ("kind", "counted", "held"),
    [
        (CYLINDER, [[182, 360, 266, 936], [722, 1440, 1647, 7488]], [19, 61]),
        (LIVER, [[140, 276], [554, 1104], [2210, 4416]], None),
        (BOX, [[63 - 5, 2 * (4 + 4 + 4 * 12), 63, 144]], [9, 25]),
    ],
    ids=["cylinder", "liver", "box"],
)
def test_a_solid_has_its_counts_and_is_nested(kind, counted, held):
    body = make_body("body", kind)
    found = counts(body)
    assert [row[: len(mine)] for row, mine in zip(found, counted, strict=False)] == counted
    check_nesting(body)
    if held:
        assert [len(nodes) for nodes in body.anchors] == held
        return
    back = np.intersect1d(body.anchors[0], body.coarse.surface)  # the liver's bare area is there
    assert 8 <= len(back) <= 0.2 * 140 and body.coarse.normals[back].mean(axis=0)[1] > 0.5


BED = {"sphere": {"center_m": [0.0, -0.03, 0.1], "radius_m": 0.05}, "stiffness_n_m3": 1e5}


def test_a_body_on_a_bed_needs_no_anchors():
    body = make_body("cylinder", CYLINDER.but(anchors=None, bed=BED))
    assert [len(held) for held in body.anchors] == [0, 0]
    assert body.bed.center_m.tolist() == [0.0, -0.03, 0.1] and body.bed.stiffness_n_m3 == 1e5
    both = make_body("cylinder", CYLINDER.but(bed=BED))
    assert len(both.anchors[0]) == 19 and both.bed.radius_m == 0.05
    assert make_body("cylinder", CYLINDER).bed is None


def test_finer_keeps_the_bed_and_the_densities_of_a_ct(cube, material):
    body = nest("cube", cube, 1, np.arange(4), material, bed=Bed(np.array([0.5, 0.5, 0.0]), 0.8, 1e5))
    body = replace(body, densities=[1000.0 + level.nodes[:, 0] for level in body.levels])
    assert finer(body).bed is body.bed
    assert finer(body).densities[2] == pytest.approx(1000.0 + finer(body).fine.nodes[:, 0])
    assert len(body.up_to(0).densities) == len(body.up_to(0).levels) == len(body.up_to(0).anchors) == 1


def held(name, rule, mesh):
    return choose_anchors(name, TypeAdapter(Rule).validate_python(rule), mesh).tolist()


def test_rules_find_the_nodes_that_they_name(cube):
    rules = {
        "plane": Plane(axis="z", side="min", depth_m=0.01),
        "numbers": Anchors(nodes=[3, 0, 1, 2]),
        "sphere": Sphere(center_m=[0.5, 0.5, 0], radius_m=0.8),
    }
    assert [held("cube", rule, cube) for rule in rules.values()] == [[0, 1, 2, 3]] * 3
    ends = [Plane(axis="x", side=side, depth_m=0.01) for side in ("min", "max")]
    assert held("cube", ends[1], cube) == [1, 3, 5, 7]
    assert held("cube", [ends[1], Anchors(nodes=[0])], cube) == [0, 1, 3, 5, 7]
    with pytest.raises(InputError, match="several holds every node of the surface"):
        held("cube", ends, cube)


def test_each_piece_must_be_held_so_that_it_cannot_turn_and_a_sheet_may_hang_by_a_line(cube):
    nodes = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
    mesh = TetMesh(nodes, np.array([[0, 1, 3, 4], [1, 2, 3, 4]]))
    with pytest.raises(InputError, match="not on a line"):
        held("bar", Anchors(nodes=[0, 1, 2]), mesh)
    edge = Plane(axis="x", side="min", depth_m=0.0)
    assert held("cloth", edge, sheet([0.2, 0.1], [4, 2], 0.001)) == [0, 1, 2]
    two = TetMesh(
        np.vstack([cube.nodes, cube.nodes + np.array([3, 0, 0])]), np.vstack([cube.tetrahedra, cube.tetrahedra + 8])
    )
    with pytest.raises(InputError, match="no node of the piece of node 8, one of 2;"):
        held("two", Anchors(nodes=[0, 1, 2, 3]), two)
    assert len(held("two", Plane(axis="z", side="min", depth_m=0), two)) == 8


@pytest.mark.parametrize(
    ("rule", "message"),
    [
        ({"nodes": [1, 8]}, r"anchors\.nodes names 8"),
        ({"nodes": list(range(8))}, r"nodes holds every node of the surface, .* hold fewer: the body is 1 × 1"),
        ({"sphere": {"center_m": [9, 9, 9], "radius_m": 1}}, r"anchors\.sphere holds no node"),
        ({"nodes": [0, 1]}, "turn about the held nodes; hold three"),
        ({"several": [{"nodes": [0]}, {"nodes": [9]}]}, "names 9"),
    ],
)
def test_a_rule_that_cannot_hold_the_body(cube, rule, message):
    with pytest.raises(InputError, match=f"^body cube: .*{message}"):
        held("cube", Anchors(**rule), cube)


def test_without_a_rule_the_low_end_of_the_longest_side_is_held(cube):
    long = TetMesh(cube.nodes * [1, 1, 3], cube.tetrahedra)
    with pytest.warns(UserWarning, match=r"^anchors is not given; the nodes within 0\.3 m of its lowest z, "):
        rule = default_anchors("cube", long)
    assert held("cube", rule, long) == [0, 1, 2, 3]


def test_free_surface_nodes_have_their_rows_and_others_are_refused(slab):
    contacts, inside = contacts_of(slab), np.setdiff1d(np.arange(len(slab.coarse.nodes)), slab.coarse.surface)
    assert contacts.tolist() == [node for node in slab.coarse.surface if node not in slab.anchors[0]]
    assert [row_of(contacts, int(node)) for node in contacts] == list(range(len(contacts)))
    for contact in (slab.anchors[0][0], inside[0], len(slab.coarse.nodes), -1):
        with pytest.raises(InputError, match=rf"^slab, contact {contact} is not a free surface node of the mesh"):
            row_of(contacts, int(contact), "slab, ")


def test_kept_contacts_are_pressed_ones_and_no_more_than_there_are(slab):
    able = pressed_contacts(slab, contacts_of(slab))
    assert np.array_equal(kept_contacts(slab, 1000), able)
    assert np.array_equal(kept_contacts(slab, None), contacts_of(slab))
    few = kept_contacts(slab, 7)
    assert len(few) == 7 and (np.diff(few) > 0).all() and np.isin(few, able).all()
    assert np.isin(kept_contacts(slab, 6), few).all()


def test_kept_contacts_are_spread_evenly(beam):
    """No contact is farther from a kept one than those are from each other, and chance leaves larger gaps."""

    def gap(kept):
        return cdist(beam.coarse.nodes[able], beam.coarse.nodes[kept]).min(axis=1).max()

    able = pressed_contacts(beam, contacts_of(beam))
    kept = kept_contacts(beam, 20)
    assert gap(kept) <= pdist(beam.coarse.nodes[kept]).min() * (1 + 1e-12)
    random = np.random.default_rng(1)
    assert gap(kept) < 0.7 * np.mean([gap(random.choice(able, 20, replace=False)) for _ in range(50)])


@pytest.fixture(scope="module")
def skfem_cube():
    return skfem.MeshTet.init_tensor(*(np.linspace(0.0, 0.1, 3),) * 3)


def from_skfem(mesh, **given):
    return Body.from_skfem(mesh, **({"young_pa": 3e3, "poisson": 0.3} | given))


def test_numbers_of_nodes_and_a_mask_hold_the_same_nodes(skfem_cube):
    mask = skfem_cube.p[2] == 0.0
    numbers = np.flatnonzero(mask)
    for anchors in (mask, numbers, numbers.tolist()):
        assert np.array_equal(from_skfem(skfem_cube, anchors=anchors).anchors[0], numbers)
    box = {"sizes_m": (0.1, 0.1, 0.1), "divisions": (2, 2, 2), "young_pa": 3e3, "poisson": 0.3}
    assert Box(**box, anchors=[0, 1, 3]).make().anchors[0].tolist() == [0, 1, 3]


@pytest.mark.parametrize(
    "given",
    [
        {"young_pa": np.nan}, {"poisson": 0.6}, {"law": "hooke"}, {"refinements": 9},
        {"anchors": np.ones(3, dtype=bool)}, {"anchors": [0, 1, 99]}, {"anchors": [1.5]},
    ],
)  # fmt: skip
def test_a_mesh_of_scikit_fem_makes_no_body_that_a_box_would_not(skfem_cube, given):
    with pytest.raises(InputError):
        from_skfem(skfem_cube, **given)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda mesh: mesh.scaled(1000.0), r"mesh\.scaled\(0\.001\)"),
        (lambda mesh: skfem.MeshTet(np.where(mesh.p == 0.05, np.nan, mesh.p), mesh.t), "NaN"),
        (lambda mesh: skfem.MeshTet(np.hstack([mesh.p, [[0.1], [0.2], [0.3]]]), mesh.t), "no tetrahedron"),
        (skfem.MeshTet2.from_mesh, "MeshTet"),
        (lambda mesh: skfem.MeshHex(), "MeshTet"),
    ],
)
def test_a_mesh_of_scikit_fem_that_is_no_body_is_refused(skfem_cube, change, said):
    with pytest.raises(InputError, match=said):
        from_skfem(change(skfem_cube))
