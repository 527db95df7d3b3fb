import threading

import numpy as np
import pytest

from palpate.bodies.surfaces.decimate import fibonacci_sphere, triangulate
from palpate.bodies.surfaces.tetrahedralize import gmsh_session, tetrahedralize
from palpate.errors import InputError


def test_keeps_the_surface_and_its_volume(octahedron):
    points, triangles = octahedron
    mesh = tetrahedralize(points, triangles)
    assert np.array_equal(mesh.nodes[:6], points)
    assert {frozenset(t) for t in mesh.triangles.tolist()} == {frozenset(t) for t in triangles.tolist()}
    assert mesh.volumes.min() > 0
    assert mesh.volumes.sum() == pytest.approx(4 / 3)


@pytest.fixture
def ball():
    points = fibonacci_sphere(300)
    return points, triangulate(points)


def test_spacing_sets_the_number_of_inner_nodes(ball):
    fine, coarse = (len(tetrahedralize(*ball, spacing_m=spacing).nodes) - 300 for spacing in (0.15, 0.3))
    assert fine > 3 * coarse > 0


def test_a_hollow_body_keeps_its_hole(ball):
    points, triangles = ball
    mesh = tetrahedralize(np.vstack([points, 0.5 * points]), np.vstack([triangles, triangles[:, ::-1] + 300]))
    outer = tetrahedralize(*ball).volumes.sum()
    assert mesh.volumes.sum() == pytest.approx(outer * (1 - 0.5**3))


def test_is_the_same_every_time_and_off_the_main_thread(ball):
    first = tetrahedralize(*ball)
    found = []
    thread = threading.Thread(target=lambda: found.append(tetrahedralize(*ball)))
    thread.start()
    thread.join()
    assert np.array_equal(found[0].nodes, first.nodes)
    assert np.array_equal(found[0].tetrahedra, first.tetrahedra)


def test_leaves_no_state_behind():
    import gmsh

    with pytest.raises(RuntimeError), gmsh_session():
        raise RuntimeError
    assert not gmsh.isInitialized()


def test_two_shells_are_two_bodies(octahedron):
    points, triangles = octahedron
    both = np.vstack([points, points + np.array([3, 0, 0])])
    with pytest.raises(InputError, match=r"^two\.stl: the surface has 2 separate shells; give each body"):
        tetrahedralize(both, np.vstack([triangles, triangles + 6]), source="two.stl")


def test_says_which_surface_cuts_through_itself(octahedron):
    points, triangles = octahedron
    points[5] = [1, 1, 1]
    with pytest.raises(InputError, match=r"^knot\.stl: gmsh .*itself\.$"):
        tetrahedralize(points, triangles, source="knot.stl")
