"""Organs of smooth shape: counts, sizes, angles, and what their refinement snaps to."""

import numpy as np
import pytest

from palpate.bodies.make_body import make_body
from palpate.bodies.material import Material
from palpate.bodies.mesh_quality import quality
from palpate.bodies.organs import SAMPLES, kidney, kidney_shape, liver, liver_shape, stomach, stomach_shape
from palpate.bodies.refinement import refine
from palpate.bodies.surfaces.decimate import fibonacci_sphere

MATERIAL = {"young_pa": 3000.0, "poisson": 0.3, "density_kg_m3": 1000.0}
ORGANS = {
    "liver": (liver, liver_shape, 0.2),
    "kidney": (kidney, kidney_shape, 0.11),
    "stomach": (stomach, stomach_shape, 0.25),
}


@pytest.fixture(scope="module", params=ORGANS)
def organ(request):
    """Its name, coarse mesh, shape and length."""
    build, shape, length = ORGANS[request.param]
    return request.param, build(length), shape, length


@pytest.fixture(scope="module")
def smooth(organ):
    name, coarse, _, length = organ
    anchors = {"sphere": {"center_m": coarse.nodes[coarse.surface[0]].tolist(), "radius_m": 0.3 * length}}
    return make_body(
        "own", {"kind": name, "length_m": length, "refinements": 2, "smooth": True, "anchors": anchors, **MATERIAL}
    )


def smooth_points(shape, length, count=200_000):
    points = shape(fibonacci_sphere(count))
    low, high = points.min(axis=0), points.max(axis=0)
    return (points - (low + high) / 2) * (length / (high - low).max())


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
    name, coarse, _, length = organ
    again = ORGANS[name][0](length)
    assert np.array_equal(again.nodes, coarse.nodes) and np.array_equal(again.tetrahedra, coarse.tetrahedra)
    assert np.allclose(ORGANS[name][0](2 * length).nodes, 2 * coarse.nodes, rtol=0, atol=1e-12)


def test_shapes_keep_their_outside_out(organ):
    """The volume that the dense surface encloses, with its sign: a mirrored map would turn normals inward."""
    from palpate.bodies.surfaces.decimate import triangulate

    _, coarse, shape, length = organ
    sphere = fibonacci_sphere(SAMPLES)
    a, b, c = (smooth_points(shape, length, SAMPLES)[triangulate(sphere)[:, i]] for i in range(3))
    volume = np.einsum("ij,ij->", np.cross(a, b), c) / 6
    # the coarse mesh cuts off what bulges
    assert 0.9 < coarse.volumes.sum() / volume < 1.0


def test_smooth_levels_lie_on_the_shape_and_are_well_shaped(organ, smooth):
    from scipy.spatial import cKDTree

    _, coarse, shape, length = organ
    tree = cKDTree(smooth_points(shape, length))
    finest = tree.query(smooth.fine.nodes[smooth.fine.surface])[0]
    assert finest.max() < 0.005 * length
    assert np.array_equal(smooth.coarse.nodes, coarse.nodes)
    middle = smooth.levels[1]
    on = tree.query(middle.nodes[middle.surface])[0]
    flat = tree.query(refine(coarse)[0].nodes[middle.surface])[0]
    assert np.quantile(on, 0.95) < 0.005 * length < 0.5 * flat.max()
    # the least is at the tip of the outlet of the stomach
    assert min(quality(mesh)["min_dihedral_deg"] for mesh in smooth.levels) > 14
    assert middle.volumes.sum() > 1.03 * coarse.volumes.sum()


def test_the_material_is_the_entrys(smooth):
    assert smooth.material == Material(3000.0, 0.3, 1000.0)


def test_kidney_has_a_hollow_and_stomach_a_bend():
    """The middle of the line between the ends lies outside: nearer to the hollow side than the surface is."""
    bean, bent = kidney(0.11), stomach(0.25)
    low, high = bean.nodes[:, 2] < -0.035, bean.nodes[:, 2] > 0.035
    ends = (bean.nodes[low, 0].min() + bean.nodes[high, 0].min()) / 2
    middle = np.abs(bean.nodes[:, 2]) < 0.012
    assert bean.nodes[middle, 0].min() > ends + 0.005
    x, _, z = bent.nodes.T
    # the outlet points to the patient's right and is thinner than the fundus
    assert np.ptp(z[x < -0.07]) < 0.5 * np.ptp(x[z > 0.05])
    # nothing of it is on the right above the outlet
    assert x[z > 0.02].min() > -0.03 and x.min() < -0.1
