import numpy as np
import pytest

from palpate.bodies.body import nest
from palpate.bodies.box import box
from palpate.bodies.mesh_quality import check_boundary, check_tetrahedra, quality
from palpate.effects.linear_elements import LinearElements


def test_a_box_is_whole():
    mesh = box([0.4, 0.1, 0.2], [4, 2, 3])
    assert (len(mesh.nodes), len(mesh.tetrahedra)) == (5 * 3 * 4, 6 * 24)
    assert mesh.volumes == pytest.approx(np.full(144, 0.4 * 0.1 * 0.2 / 144))
    assert mesh.nodes.min(axis=0).tolist() == [0, 0, 0]
    assert mesh.nodes.max(axis=0) == pytest.approx([0.4, 0.1, 0.2])
    assert mesh.areas.sum() == pytest.approx(2 * (0.4 * 0.1 + 0.4 * 0.2 + 0.1 * 0.2))
    check_tetrahedra("box", mesh.nodes, mesh.tetrahedra)
    check_boundary("box", mesh)


@pytest.mark.parametrize("sizes", [[1, 1, 1], [2, 1, 3]])
def test_refined_elements_keep_their_shape_and_symmetry(material, sizes):
    body = nest("cube", box(sizes, [2, 2, 2]), 2, np.arange(9), material)
    coarse, fine = quality(body.coarse), quality(body.fine)
    for key in ("min_dihedral_deg", "max_dihedral_deg", "min_radius_ratio"):
        assert fine[key] == pytest.approx(coarse[key])
    lattice = np.rint(body.fine.nodes * 8 / sizes).astype(int)
    number = {tuple(p): i for i, p in enumerate(lattice.tolist())}
    elements = {tuple(t) for t in np.sort(body.fine.tetrahedra, axis=1).tolist()}
    for axis in range(3):
        image = lattice.copy()
        image[:, axis] = 8 - image[:, axis]
        mirrored = np.array([number[tuple(p)] for p in image.tolist()])[body.fine.tetrahedra]
        assert {tuple(t) for t in np.sort(mirrored, axis=1).tolist()} == elements


def test_a_bar_does_not_lean_when_bent(material):
    """Pushed in y at its tip it moves neither in z on average nor about its axis, and as far as when pushed in z."""
    mesh = box([0.4, 0.1, 0.1], [4, 2, 2])
    stiffness = LinearElements(mesh, material).stiffness(mesh.nodes).toarray()
    free = np.repeat(mesh.nodes[:, 0] > 0, 3)
    tip = np.flatnonzero(mesh.nodes[:, 0] == 0.4)
    found = []
    for axis in (1, 2):
        load = np.zeros_like(mesh.nodes)
        load[tip, axis] = 1e-3
        moved = np.zeros(mesh.nodes.size)
        moved[free] = np.linalg.solve(stiffness[np.ix_(free, free)], load.ravel()[free])
        found.append(moved.reshape(-1, 3)[tip])
    y, z = (moved[:, axis].mean() for moved, axis in zip(found, (1, 2), strict=True))
    assert y == pytest.approx(z, rel=1e-10)
    assert abs(found[0][:, 2].mean()) < 1e-10 * y
    arm = mesh.nodes[tip] - [0.4, 0.05, 0.05]
    assert abs(np.cross(arm, found[0])[:, 0].mean()) < 1e-10 * y * 0.1
