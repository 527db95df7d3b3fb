import numpy as np
import pytest

from palpate.bodies.box import sheet
from palpate.bodies.mesh import TetMesh


@pytest.fixture
def cloth():
    return sheet([0.3, 0.2], [6, 4], 0.001)


def test_a_sheet_is_flat_and_whole(cloth):
    assert (len(cloth.nodes), len(cloth.triangles)) == (7 * 5, 48)
    assert not cloth.nodes[:, 2].any()
    assert cloth.areas.sum() == pytest.approx(0.06, rel=1e-14)
    assert np.array_equal(cloth.normals, np.tile([0.0, 0.0, 1.0], (35, 1)))
    assert (cloth.size, cloth.thickness_m) == (pytest.approx(0.3), 0.001)
    # Euler's formula for a disc
    assert len(cloth.nodes) - len(cloth.edges) + len(cloth.triangles) == 1


def test_it_offers_what_a_solid_offers(cloth):
    assert cloth.tetrahedra.shape == (0, 4)
    assert np.array_equal(cloth.surface, np.arange(35))
    public = {name for name in dir(TetMesh) if not name.startswith("_")} - {"volumes"}
    assert all(hasattr(cloth, name) for name in public)


def test_no_corner_of_a_sheet_hangs_by_one_triangle(cloth):
    """With even divisions a diagonal ends in each corner, so that it can be bent along no single edge."""
    corners = [0, 4, 30, 34]
    assert np.bincount(cloth.triangles.ravel())[corners].tolist() == [2, 2, 2, 2]
