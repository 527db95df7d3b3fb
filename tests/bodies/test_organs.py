"""Organs of smooth shape: counts, angles, and finer meshes against formulas of their surfaces."""

import warnings
from functools import cache, partial

import numpy as np
import pytest
from fixtures.bodies import made
from fixtures.organs import volume
from scipy.optimize import least_squares

from palpate.bodies import organs
from palpate.bodies.mesh import TetMesh
from palpate.bodies.mesh_quality import quality
from palpate.bodies.organs import SAMPLES, SHAPES, SmoothSurface, coarse_body, kidney_shape, liver_shape, stomach_shape
from palpate.bodies.refinement import finer, refine, with_midpoints
from palpate.bodies.surfaces.remesh import fibonacci_sphere, triangulate
from palpate.errors import InputError


def test_kidney_has_a_hollow_and_stomach_a_bend():
    """The middle of the line between the ends lies outside: nearer to the hollow side than the surface is."""
    bean, bent = coarse_body(kidney_shape, 0.11), coarse_body(stomach_shape, 0.25)
    low, high = bean.nodes[:, 2] < -0.035, bean.nodes[:, 2] > 0.035
    ends = (bean.nodes[low, 0].min() + bean.nodes[high, 0].min()) / 2
    middle = np.abs(bean.nodes[:, 2]) < 0.012
    assert bean.nodes[middle, 0].min() > ends + 0.005
    x, _, z = bent.nodes.T
    # the outlet points to the patient's right and is thinner than the fundus
    assert np.ptp(z[x < -0.07]) < 0.5 * np.ptp(x[z > 0.05])
    # nothing of it is on the right above the outlet
    assert x[z > 0.02].min() > -0.03 and x.min() < -0.1


MATERIAL = {"young_pa": 3000.0, "poisson": 0.3, "density_kg_m3": 1000.0}
ORGANS = {
    "liver": (liver_shape, 0.2),
    "kidney": (kidney_shape, 0.11),
    "stomach": (stomach_shape, 0.25),
}


@pytest.fixture(
    scope="module",
    params=["kidney", *(pytest.param(name, marks=pytest.mark.slow) for name in ORGANS if name != "kidney")],
)
def organ(request):
    """Its name, coarse mesh, shape and length."""
    shape, length = ORGANS[request.param]
    return request.param, coarse_body(shape, length), shape, length


@cache
def bounds(shape):
    points = shape(fibonacci_sphere(SAMPLES))
    return points.min(axis=0), points.max(axis=0)


def smooth(shape, length, directions):
    """Places of the smooth shape, around the middle of its box, for directions from the origin."""
    low, high = bounds(shape)
    on_sphere = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    return (shape(on_sphere) - (low + high) / 2) * (length / (high - low).max())


def test_counts_sizes_and_angles(organ):
    name, coarse, _, length = organ
    assert (len(coarse.surface), len(coarse.triangles)) == (140, 276)
    assert 140 < len(coarse.nodes) < 200
    assert coarse.size == pytest.approx(length, rel=0.01)
    for mesh in (coarse, refine(coarse)[0]):
        found = quality(mesh)
        assert found["min_dihedral_deg"] > 15 and found["min_radius_ratio"] > 0.3
    litres = {"liver": (1.0, 1.6), "kidney": (0.1, 0.2), "stomach": (1.0, 2.0)}[name]
    assert litres[0] < 1e3 * coarse.volumes.sum() < litres[1]


def test_it_is_the_same_every_time_and_scales(organ):
    _, coarse, shape, length = organ
    again = coarse_body(shape, length)
    assert np.array_equal(again.nodes, coarse.nodes) and np.array_equal(again.tetrahedra, coarse.tetrahedra)
    for scale in (2.0, 1.37, 1e-2 / 3):
        other = coarse_body(shape, scale * length)
        assert np.array_equal(other.tetrahedra, coarse.tetrahedra)
        assert np.allclose(other.nodes, scale * coarse.nodes, rtol=0, atol=1e-12)


def test_shapes_keep_their_outside_out(organ):
    """The volume that the dense surface encloses, with its sign: a mirrored map would turn normals inward."""
    _, coarse, shape, length = organ
    sphere = fibonacci_sphere(SAMPLES)
    # the coarse mesh cuts off what bulges
    assert 0.9 < coarse.volumes.sum() / volume(smooth(shape, length, sphere), triangulate(sphere)) < 1.0


LENGTH, RADIUS = 0.2, 0.03


def bar(smooth, refinements):
    anchors = {"plane": {"axis": "z", "side": "min", "depth_m": 0.001}}
    entry = {"kind": "cylinder", "length_m": LENGTH, "radius_m": RADIUS, "anchors": anchors} | MATERIAL
    return made("bar", entry | {"refinements": refinements} | ({} if smooth is None else {"smooth": smooth}))


@pytest.fixture(scope="module")
def pair():
    """The bar of facets and the round one, of three levels."""
    return bar(False, 2), bar(True, 2)


def test_volume_and_area_of_a_round_bar_converge_with_order_2_and_those_of_facets_do_not(pair):
    exact = np.pi * RADIUS**2 * LENGTH, 2 * np.pi * RADIUS * (LENGTH + RADIUS)
    for true, of in zip(exact, (lambda mesh: mesh.volumes.sum(), lambda mesh: mesh.areas.sum()), strict=True):
        facets, smooth = (np.array([1 - of(mesh) / true for mesh in body.levels]) for body in pair)
        assert np.ptp(facets) < 1e-12 and facets[0] > 0.01
        assert np.allclose(np.log2(smooth[:-1] / smooth[1:]), 2.0, atol=0.02)
        assert smooth[0] == pytest.approx(facets[0]) and 0 < smooth[2] < 4e-3


def test_a_bar_of_facets_says_how_much_smaller_its_section_is():
    """A polygon of twelve sides has 3 r² of the circle's π r²."""
    with pytest.warns(UserWarning, match=r"is 27 cm², 4\.5 % less than the circle's, .*; divide forces by that"):
        assert bar(None, 1).fine.volumes.sum() / LENGTH == pytest.approx(3 * RADIUS**2)
    with warnings.catch_warnings(action="error"):
        bar(True, 2), bar(False, 1)
    with pytest.warns(UserWarning, match=r"1\.1 % less than the circle's"):
        bar(True, 1)


def test_a_round_bar_has_round_sides_flat_ends_and_sound_elements(pair):
    facets, smooth = pair
    for flat, mesh in zip(facets.levels, smooth.levels, strict=True):
        x, y, z = mesh.nodes[mesh.surface].T
        side = (z > 1e-9) & (z < LENGTH - 1e-9)
        assert np.abs(np.hypot(x, y)[side] - RADIUS).max() < 1e-12
        rim = np.arctan2(y, x)[~side & (np.hypot(x, y) > (1 - 1e-9) * RADIUS)]
        assert np.allclose(np.bincount(np.round(rim * len(rim) / 4 / np.pi).astype(int) % (len(rim) // 2)), 2)
        assert np.allclose(mesh.nodes[:, 2], flat.nodes[:, 2], atol=1e-15)  # an end's nodes stay within its plane
        assert quality(mesh)["min_dihedral_deg"] > 30 and mesh.volumes.min() > 0


@pytest.mark.parametrize("kind", SHAPES)
def test_new_surface_nodes_of_an_organ_satisfy_its_formula(kind):
    """By an optimizer that looks for the place of the sphere, from the nearest of random ones."""
    shape, surface = SHAPES[kind], SmoothSurface(kind, 0.2)
    coarse = coarse_body(shape, 0.2)
    halved, _ = refine(coarse)
    first = len(coarse.nodes)
    moved = surface.snap(halved, first)
    assert np.array_equal(moved.nodes[:first], coarse.nodes) and moved.volumes.min() > 0
    assert quality(moved)["min_dihedral_deg"] > 15
    places = partial(smooth, shape, 0.2)
    starts = np.random.default_rng(0).normal(size=(20_000, 3))
    tried = places(starts)
    new = moved.surface[moved.surface >= first]
    assert np.linalg.norm(moved.nodes[new] - halved.nodes[new], axis=1).max() > 2e-3
    for node in moved.nodes[new[:: len(new) // 6]]:
        start = starts[np.argmin(np.linalg.norm(tried - node, axis=1))]
        found = least_squares(lambda s, node=node: 1e3 * (places(s[None])[0] - node), start, xtol=1e-15, ftol=1e-15)
        assert np.linalg.norm(found.fun) < 1e-6  # a nanometre; facets are millimetres away


def test_levels_for_quadratic_elements_are_halfway_where_the_body_has_none():
    body = bar(True, 1)
    whole = with_midpoints(body, 1)
    assert np.allclose(whole.fine.nodes, whole.prolongations[1] @ body.fine.nodes) and whole.smooth is None
    assert with_midpoints(body, 0) is body
    assert np.array_equal(with_midpoints(body, 2).levels[2].nodes, finer(body).fine.nodes)


def test_bad_elements_are_refused(monkeypatch):
    """A surface that is moved through the body."""
    mesh, _ = refine(bar(False, 0).coarse)
    inverted = TetMesh(mesh.nodes * [1.0, 1.0, -1.0], mesh.tetrahedra)
    monkeypatch.setattr(organs, "_snapper", lambda surface: lambda mesh, first: inverted)
    with pytest.raises(InputError, match=r"elements with dihedral angles of .*; give smooth: false"):
        SmoothSurface("cylinder", RADIUS).snap(mesh, 266)
