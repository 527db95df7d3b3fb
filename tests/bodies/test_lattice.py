import numpy as np
import pytest

from palpate.bodies.box import cut_lattice


def as_set(simplices):
    return {tuple(s) for s in np.sort(simplices, axis=1).tolist()}


def moved(points, simplices, image):
    """The simplices after each point went to its image, (n, d), which is a lattice point too."""
    number = {tuple(p): i for i, p in enumerate(points.tolist())}
    return as_set(np.array([number[tuple(p)] for p in image.tolist()])[simplices])


@pytest.mark.parametrize("divisions", [[4, 2], [2, 4, 6]])
def test_the_mesh_is_its_own_mirror_image(divisions):
    points, simplices = cut_lattice(divisions)
    for axis, count in enumerate(divisions):
        image = points.copy()
        image[:, axis] = count - image[:, axis]
        assert moved(points, simplices, image) == as_set(simplices)


@pytest.mark.parametrize("divisions", [[3, 3], [3, 3, 3]])
def test_no_axis_comes_first(divisions):
    points, simplices = cut_lattice(divisions)
    for shift in range(1, len(divisions)):
        assert moved(points, simplices, np.roll(points, shift, axis=1)) == as_set(simplices)


@pytest.mark.parametrize(("divisions", "each"), [([3, 2], 2), ([1, 1], 2), ([3, 2, 1], 6)])
def test_simplices_are_alike_and_fill_the_cells(divisions, each):
    points, simplices = cut_lattice(divisions)
    assert len(simplices) == each * np.prod(divisions)
    edges = points[simplices[:, 1:]] - points[simplices[:, :1]]
    assert np.allclose(np.abs(np.linalg.det(edges)), 1.0)
    assert len(points) == np.prod(np.array(divisions) + 1)
