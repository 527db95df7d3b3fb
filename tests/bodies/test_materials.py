"""Relaxation against integrals and limits, and regions of other materials."""

import warnings

import numpy as np
import pytest
from fixtures.bodies import made
from fixtures.mesh_encodings import SOLIDS, halves, lopsided
from scipy.integrate import quad

from palpate.bodies.ct.synthetic_abdomen import LESION
from palpate.bodies.material import Material, Series, prony_fault
from palpate.bodies.mesh_quality import dihedral_angles
from palpate.bodies.refinement import finer
from palpate.bodies.simple_shapes import box
from palpate.errors import InputError

SERIES = Series([0.3, 0.2], [0.1, 2.0])


def test_the_modulus_falls_from_its_first_value_to_its_last():
    assert SERIES.modulus(0.0) == pytest.approx(1 / (1 - 0.5), rel=1e-14)
    assert SERIES.modulus(1e9) == pytest.approx(1.0, rel=1e-14)
    t = np.linspace(0.0, 3.0, 50)
    of_first = 1.0 - 0.3 * (1 - np.exp(-t / 0.1)) - 0.2 * (1 - np.exp(-t / 2.0))
    assert SERIES.modulus(t) == pytest.approx(of_first / 0.5, rel=1e-13)


@pytest.mark.parametrize("h", [1e-4, 0.05, 1.0, 30.0])
def test_a_step_is_the_integral_over_an_even_change_of_strain(h):
    a, b = SERIES.factors(h)
    for tau, kept, gained in zip(SERIES.times_s, a, b, strict=True):
        memory, _ = quad(lambda t, tau=tau: np.exp(-(h - t) / tau) / h, 0.0, h, points=[max(0.0, h - 20 * tau)])
        assert gained == pytest.approx(memory, rel=1e-9)
        assert kept == pytest.approx(np.exp(-h / tau), rel=1e-14)


@pytest.mark.parametrize(
    ("shares", "times", "said"),
    [
        ([0.5], [1.0, 2.0], "shares has 1 numbers and times_s 2; give one"),
        ([], [], "shares has 0 numbers and times_s 0; give one"),
        ([0.5, -0.1], [1.0, 2.0], "shares has -0.1; give numbers above 0"),
        ([0.5, 0.495], [1.0, 2.0], "shares has the sum 0.995, of which 0.99 is the most"),
        ([float("nan")], [1.0], "shares has nan"),
        ([0.5], [0.0], "times_s has 0; give times"),
        ([0.5], [float("inf")], "times_s has inf; give times"),
    ],
)
def test_a_series_that_is_none_is_refused(shares, times, said):
    assert prony_fault(Series(shares, times)).startswith(said)


STIFF = 30000.0
BALL = {"center_m": [0.05, 0.05, 0.05], "radius_m": 0.03}


@pytest.fixture
def block(entry):
    """A cube of 10 cm whose ball of 3 cm is ten times as stiff."""
    return entry | {
        "kind": "box",
        "sizes_m": [0.1, 0.1, 0.1],
        "divisions": [8, 8, 8],
        "regions": {"tumour": {"sphere": BALL, "young_pa": STIFF}},
    }


def middles(mesh):
    return mesh.nodes[mesh.tetrahedra].mean(axis=1)


def test_a_sphere_holds_the_elements_that_are_in_it_by_half(block):
    body = made("block", block)
    tissue, mesh = body.tissue(0), body.coarse
    assert [each.young_pa for each in tissue.materials] == [3000, STIFF]
    assert set(np.unique(tissue.young_pa)) == {3000, STIFF}
    distance = np.linalg.norm(middles(mesh) - 0.05, axis=1)
    assert (tissue.region[distance < 0.024] == 1).all() and (tissue.region[distance > 0.036] == 0).all()
    ball = 4 / 3 * np.pi * 0.03**3
    assert mesh.volumes[tissue.region == 1].sum() == pytest.approx(ball, rel=0.05)


def test_parts_of_a_refined_element_have_its_material(block):
    body = made("block", block | {"divisions": [3, 3, 3], "refinements": 2})
    for level, mesh in enumerate(body.levels):
        corners = body.coarse.nodes[body.coarse.tetrahedra]
        # the parent is the coarse element that contains the middle
        steps = np.linalg.inv(np.moveaxis(corners[:, 1:] - corners[:, :1], 1, 2))
        for middle, number in zip(middles(mesh)[::7], body.tissue(level).region[::7], strict=True):
            inner = np.einsum("eij,ej->ei", steps, middle - corners[:, 0])
            parent = np.argmax(np.minimum(inner.min(axis=1), 1 - inner.sum(axis=1)))
            assert number == body.regions.region[parent]
    assert np.array_equal(finer(body).tissue(3).region, np.repeat(body.tissue(2).region, 8))
    deepest = [mesh.volumes[body.tissue(i).region == 1].sum() for i, mesh in enumerate(body.levels)]
    assert deepest == pytest.approx([deepest[0]] * 3, rel=1e-12)


def test_the_first_region_wins_and_constants_default_to_the_body_s(block):
    inner = {"center_m": [0.05, 0.05, 0.05], "radius_m": 0.02}
    rules = {
        "core": {"sphere": inner, "young_pa": 1e5, "poisson": 0.45, "density_kg_m3": 1200},
        "rim": {"sphere": BALL, "young_pa": 1e4},
    }
    tissue = made("block", block | {"regions": rules}).tissue(0)
    assert tissue.materials[1:] == (Material(1e5, 0.45, 1200), Material(1e4, 0.3, 1000))
    mesh = box([0.1] * 3, [8, 8, 8])
    assert (tissue.region[np.linalg.norm(middles(mesh) - 0.05, axis=1) < 0.014] == 1).all()
    assert set(tissue.region) == {0, 1, 2}


def test_an_organ_is_meshed_finely_where_a_region_is(entry):
    organ = entry | {
        "kind": "liver",
        "length_m": 0.2,
        "anchors": {"plane": {"axis": "y", "side": "max", "depth_m": 0.05}},
    }
    plain = made("liver", organ)
    sphere = {"center_m": [0.02, -0.02, 0.02], "radius_m": 0.012}
    # its volume is right to an eighth, and a seventh of it is elsewhere
    with pytest.warns(UserWarning, match=r"tumour have 6\.\d+ mL, and what is asked 7\.\d+ mL; 0\.9\d+ mL"):
        body = made("liver", organ | {"regions": {"tumour": {"sphere": sphere, "young_pa": STIFF}}})
    held = body.coarse.volumes[body.tissue(0).region == 1].sum()
    assert held == pytest.approx(4 / 3 * np.pi * 0.012**3, rel=0.15)
    assert len(plain.coarse.tetrahedra) < len(body.coarse.tetrahedra) < 3 * len(plain.coarse.tetrahedra)
    assert np.array_equal(body.coarse.nodes[body.coarse.surface], plain.coarse.nodes[plain.coarse.surface])
    assert dihedral_angles(body.coarse).min() > 8.0


def test_physical_groups_of_a_gmsh_file_are_tags(entry, tmp_path):
    mesh, path = lopsided(), tmp_path / "bar.msh"
    path.write_bytes(SOLIDS["v4.1_ascii_two.msh"](mesh.nodes, mesh.tetrahedra, ""))
    anchors = {"plane": {"axis": "z", "side": "min", "depth_m": 0.03}}
    file = entry | {"kind": "file", "path": str(path), "scale_m": 1.0, "anchors": anchors}
    for tag in (8, "half"):
        body = made("bar", file | {"regions": {"half": {"tag": tag, "young_pa": STIFF}}})
        assert np.array_equal(body.tissue(0).region == 1, halves(mesh.tetrahedra) == 8)
    # groups may overlap, and the first region wins
    regions = {"half": {"tag": 8, "young_pa": STIFF}, "whole": {"tag": 7, "young_pa": 9e4}}
    assert set(made("bar", file | {"regions": regions}).tissue(0).region) == {1, 2}


@pytest.mark.slow
def test_a_label_of_the_synthetic_abdomen_is_a_lesion(entry):
    anchors = {"sphere": {"center_m": [-0.1, -0.015, 0.04], "radius_m": 0.04}}
    body = made(
        "abdomen",
        entry
        | {"kind": "ct", "threshold_hu": [30, 120], "surface_nodes": 140, "anchors": anchors}
        | {"regions": {"lesion": {"label": "lesion", "young_pa": STIFF}}},
    )
    mesh, inside = body.coarse, body.tissue(0).region == 1
    volumes = mesh.volumes[inside]
    middle = volumes @ middles(mesh)[inside] / volumes.sum()
    assert np.linalg.norm(middle - LESION[0]) < 0.002
    assert volumes.sum() == pytest.approx(4 / 3 * np.pi * np.prod(LESION[1]), rel=0.15)


@pytest.mark.parametrize(
    ("rule", "message"),
    [
        ({"tag": 1}, r"has a tag, which only a body of kind file has; give a sphere\.$"),
        ({"label": 1}, r"has a label, which only a body of kind ct has; give a sphere\.$"),
        ({"sphere": BALL | {"center_m": [1, 1, 1]}}, "holds no tetrahedron by half"),
        (
            {"sphere": BALL | {"radius_m": 0.02}},
            r"regions\.part holds no tetrahedron that is not in a region before",
        ),
    ],
)
def test_a_wrong_region_is_refused(block, rule, message):
    before = {"all": {"sphere": BALL, "young_pa": 1e4}} if "before" in message else {}
    with pytest.raises(InputError, match=message):
        made("block", block | {"regions": before | {"part": {"young_pa": STIFF} | rule}})


@pytest.mark.parametrize(
    ("change", "region", "told"),
    [
        ({"divisions": [4, 4, 4]}, {"sphere": BALL | {"radius_m": 0.025}, "young_pa": STIFF},
         r"bodies\.block: regions .* lump have [\d.]+ mL, and what is"),
        ({}, {"sphere": BALL, "young_pa": 3e8}, r"moduli of block differ by a factor of 1e\+05, and solvers are"),
    ],
    ids=["coarse", "contrast"],
)  # fmt: skip
def test_a_region_that_is_shown_badly_or_too_stiff_is_told(block, change, region, told):
    with pytest.warns(UserWarning, match=told):
        made("block", block | change | {"regions": {"lump": region}})


def test_a_region_that_reaches_the_surface_by_its_elements_alone_is_told(block):
    """The ball ends 3 mm below the top, where elements are 12.5 mm high; one that is cut by the top is asked for."""
    for height, told in ((0.077, True), (0.085, False), (0.055, False)):
        sphere = {"center_m": [0.05, 0.05, height], "radius_m": 0.02}
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            made("block", block | {"regions": {"lump": {"sphere": sphere, "young_pa": STIFF}}})
        said = [str(one.message) for one in caught if "on the body's surface" in str(one.message)]
        assert len(said) == told and all("tetrahedra of lump have 5 nodes" in text for text in said)
