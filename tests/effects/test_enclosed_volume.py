"""The volume within a surface, against that of the elements inside it."""

import numpy as np
import pytest

from palpate.bodies.quadratic import shape_slopes, ten_nodes
from palpate.bodies.refinement import refine
from palpate.effects.linear_elements import shape_gradients
from palpate.effects.surface_integrals import enclosed_volume


@pytest.fixture(scope="module")
def mesh(box):
    return box([2, 1, 2], [0.2, 0.1, 0.3], jitter=0.2)


def inside(mesh, x):
    """Integrate det F over the quadratic elements, by a rule of degree 3 (Keast 1986)."""
    points = np.vstack([np.full(4, 0.25), np.full((4, 4), 1 / 6) + np.eye(4) / 3])
    gradients, volumes = shape_gradients(mesh)
    places, found = x[ten_nodes(mesh)], 0.0
    for weight, slopes in zip([-0.8, *[0.45] * 4], shape_slopes(points), strict=True):
        f = np.einsum("eai,ac,ecj->eij", places, slopes, gradients)
        found += weight * np.linalg.det(f) @ volumes
    return found


def test_quadratic_faces_enclose_what_their_elements_fill(mesh):
    finer, _ = refine(mesh)
    x = finer.nodes + 0.02 * np.random.default_rng(1).standard_normal(finer.nodes.shape)
    assert enclosed_volume(mesh, x) == pytest.approx(inside(mesh, x), rel=1e-12)
    assert abs(enclosed_volume(mesh, x) / enclosed_volume(finer, x) - 1.0) > 1e-3  # its flat facets enclose another


def test_at_rest_and_under_one_gradient_it_is_known(mesh):
    f = np.array([[1.1, 0.2, 0.0], [0.0, 0.9, -0.1], [0.1, 0.0, 1.3]])
    finer, _ = refine(mesh)
    for nodes in (mesh.nodes, finer.nodes):
        assert enclosed_volume(mesh, nodes) == pytest.approx(0.006, rel=1e-12)
        moved = nodes @ f.T + [3.0, -2.0, 1.0]
        assert enclosed_volume(mesh, moved) == pytest.approx(0.006 * np.linalg.det(f), rel=1e-11)
