"""The drawn surface of a cut body encloses its tissue, at rest and however the lips come apart."""

import numpy as np
import pytest
from scipy import sparse

from palpate.bodies.body import nest
from palpate.bodies.cutting import ways
from palpate.bodies.cutting.cut import Disc, blade
from palpate.bodies.cutting.ways import VIRTUAL_NODES, part, whole
from palpate.bodies.material import Material
from palpate.bodies.mesh import components
from palpate.bodies.simple_shapes import box
from palpate.press.serve.drawn import drawn

DOWN = np.array([0.0, 0.0, -1.0])


@pytest.fixture(scope="module")
def slab():
    mesh = box([0.1, 0.1, 0.04], [8, 8, 4])
    return nest("slab", mesh, 1, np.flatnonzero(mesh.nodes[:, 2] == 0.0), Material(3000.0, 0.3, 1000.0))


def made(slab, cuts, level=0):
    """The parted level, and its drawn surface."""
    fine, parted = slab.fine, part(slab, level, cuts, VIRTUAL_NODES) if cuts else whole(slab, level, 0)
    rows = sparse.csr_array(slab.prolongations[0] if level == 0 else sparse.eye_array(len(fine.nodes)))
    triangles = np.searchsorted(fine.surface, fine.triangles)
    return parted, drawn(parted, cuts, fine.nodes[fine.surface], triangles, rows[fine.surface])


def enclosed(surface, x):
    """The volume [m³] that triangles enclose where the level's nodes are at ``x``."""
    a, b, c = np.swapaxes((surface.rows @ x)[surface.triangles], 0, 1)
    return np.einsum("ij,ij->", np.cross(a, b), c) / 6.0


def tissue(parted, x):
    """The same of the elements, each as much as there is tissue in it."""
    a, b, c, d = (x[parted.mesh.tetrahedra[:, i]] for i in range(4))
    return np.einsum("ij,ij,i->", np.cross(b - a, c - a), d - a, parted.body.tissue(0).share) / 6.0


STRAIGHT = blade(box([0.1, 0.1, 0.04], [2, 2, 2]), np.array([[0.02, 0.047, 0.04], [0.08, 0.055, 0.04]]), DOWN, 0.02)
KINKED = blade(
    box([0.1, 0.1, 0.04], [2, 2, 2]),
    np.array([[0.021, 0.03, 0.04], [0.052, 0.047, 0.04], [0.06, 0.09, 0.04]]),
    DOWN,
    0.03,
)
CROSSING = blade(box([0.1, 0.1, 0.04], [2, 2, 2]), np.array([[0.047, 0.02, 0.04], [0.053, 0.08, 0.04]]), DOWN, 0.02)
CASES = {
    "straight": [STRAIGHT],
    "through": [Disc(np.array([0.047, 0.0, 0.0]), np.array([0.96, 0.28, 0.0]), 1.0)],
    "kinked": [KINKED],
    "crossing": [STRAIGHT, CROSSING],
}


@pytest.mark.parametrize("level", [0, 1])
@pytest.mark.parametrize("cuts", CASES.values(), ids=CASES)
def test_it_encloses_as_much_as_there_is_of_tissue_however_nodes_move(slab, cuts, level, monkeypatch):
    """But for slivers, which belong to the other side: where all have copies of their own, it does so to rounding."""
    for least, lacks in ((ways.LEAST_SHARE, 2e-4), (1e-13, 1e-12)):
        monkeypatch.setattr(ways, "LEAST_SHARE", least)
        parted, surface = made(slab, cuts, level)
        rest, size = parted.mesh.nodes, slab.fine.volumes.sum()
        assert np.abs(surface.rows @ rest - surface.nodes).max() < 1e-12
        assert enclosed(surface, rest) == pytest.approx(size, rel=1e-12)
        moved = rest + 0.002 * np.random.default_rng(1).normal(size=rest.shape)
        assert abs(tissue(parted, moved) - size) > 1e-3 * size
        assert abs(enclosed(surface, moved) - tissue(parted, moved)) <= lacks * size


def test_lips_face_each_other_and_come_apart_with_their_sides(slab):
    """A plane through the slab: one half is moved away, and both lips have its section's area."""
    parted, surface = made(slab, [Disc(np.array([0.047, 0.0, 0.0]), np.array([1.0, 0.0, 0.0]), 1.0)])
    piece = components(parted.mesh.edges, len(parted.mesh.nodes))
    away = np.where(piece == piece[parted.mesh.nodes[:, 0].argmax()], 0.01, 0.0)
    x = surface.rows @ (parted.mesh.nodes + np.outer(away, [1.0, 0.0, 0.0]))
    of_lips = surface.triangles.min(axis=1) >= surface.skin_nodes
    lips = surface.triangles[of_lips]
    normals = 0.5 * np.cross(x[lips[:, 1]] - x[lips[:, 0]], x[lips[:, 2]] - x[lips[:, 0]])
    far = x[lips].mean(axis=1)[:, 0] > 0.052
    assert normals[far].sum(axis=0) == pytest.approx([-0.004, 0.0, 0.0], abs=1e-9)
    assert normals[~far].sum(axis=0) == pytest.approx([0.004, 0.0, 0.0], abs=1e-9)
    assert x[lips[far]][..., 0] == pytest.approx(0.057) and x[lips[~far]][..., 0] == pytest.approx(0.047)
    ends = x[surface.rims]
    around = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)[ends[:, 0, 0] > 0.052].sum()
    assert around == pytest.approx(2 * (0.1 + 0.04)) and len(ends) % 2 == 0
    skin = x[surface.triangles[~of_lips]][..., 0]
    assert not ((skin.min(axis=1) < 0.0469) & (skin.max(axis=1) > 0.0471)).any()  # no triangle spans the cut


def test_a_body_without_a_cut_is_drawn_as_it_is(slab):
    surface = made(slab, [])[1]
    assert surface.skin_nodes == len(surface.nodes) == len(slab.fine.surface)
    assert len(surface.triangles) == len(slab.fine.triangles)
