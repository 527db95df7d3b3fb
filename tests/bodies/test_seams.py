"""Parts of a mesh that were meshed apart: welded where their faces coincide, else refused or warned of."""

import warnings

import meshio
import numpy as np
import pytest

from palpate.bodies.body import nest
from palpate.bodies.make_body import build
from palpate.bodies.material import Material
from palpate.bodies.mesh import TetMesh
from palpate.bodies.seams import check_seams, weld_pieces
from palpate.bodies.settings import File
from palpate.bodies.simple_shapes import box
from palpate.bodies.surfaces.triangles import drop_unused
from palpate.errors import InputError
from palpate.solvers.equilibrium import Equilibrium

BAR, LAYER = box([0.2, 0.02, 0.02], [20, 2, 4]), box([0.2, 0.02, 0.01], [20, 2, 2])


def together(*parts):
    """Put meshes and shifts of them [m] into one, without a node in common."""
    starts = np.cumsum([0, *(len(mesh.nodes) for mesh, _ in parts)])
    nodes = [mesh.nodes + np.array(shift) for mesh, shift in parts]
    return np.vstack(nodes), np.vstack(
        [mesh.tetrahedra + start for (mesh, _), start in zip(parts, starts, strict=False)]
    )


def halves(mesh, chosen, joined):
    """Double the nodes between the elements that are ``chosen`` (m,) and the others, but for those ``joined`` (n,)."""
    number = np.where(joined, np.arange(len(mesh.nodes)), len(mesh.nodes) + np.arange(len(mesh.nodes)))
    tetrahedra = mesh.tetrahedra.copy()
    tetrahedra[chosen] = number[tetrahedra[chosen]]
    return drop_unused(np.vstack([mesh.nodes, mesh.nodes]), tetrahedra)


UPPER = BAR.nodes[BAR.tetrahedra].mean(axis=1)[:, 2] > 0.01
NOWHERE = np.zeros(len(BAR.nodes), dtype=bool)
CORE = (np.abs(BAR.nodes[BAR.tetrahedra].mean(axis=1) - [0.1, 0.01, 0.01]) < [0.05, 0.004, 0.004]).all(axis=1)


def tip(nodes, tetrahedra):
    """Compute how far the free end of a bar hangs down [m] that is nailed where x is 0 and pulled at the other end."""
    mesh = TetMesh(nodes, tetrahedra)
    body = nest("bar", mesh, 0, np.flatnonzero(nodes[:, 0] < 1e-9), Material(1e5, 0.3, 1000))
    end = np.flatnonzero(nodes[:, 0] > 0.2 - 1e-9)
    load = np.zeros_like(nodes)
    load[end, 2] = -1e-4 / len(end)
    return -(Equilibrium(body, 0).solve(load, 1e-4).x - nodes)[end, 2].mean()


@pytest.mark.parametrize(
    ("gap", "scale", "seed"), [(0.0, 1.0, None), (3e-8, 1.0, 1), (0.0, 1e3, 2)], ids=["doubled", "30 nm", "mm"]
)
def test_two_layers_bend_as_one_bar(gap, scale, seed):
    nodes, tetrahedra = halves(BAR, UPPER, NOWHERE)
    assert len(nodes) == len(BAR.nodes) + 63
    nodes[np.unique(tetrahedra[UPPER]), 2] += gap
    if seed is not None:
        order = np.random.default_rng(seed).permutation(len(nodes))
        nodes, tetrahedra = nodes[order], np.argsort(order)[tetrahedra]
    welded, elements, said = weld_pieces(scale * nodes, tetrahedra)
    assert said == "2 pieces welded at 63 nodes, whose faces coincide to 0.0001 of an edge"
    assert len(welded) == len(BAR.nodes) and len(TetMesh(welded, elements).triangles) == len(BAR.triangles)
    assert tip(welded / scale, elements) == pytest.approx(tip(BAR.nodes, BAR.tetrahedra), rel=1e-4)


def test_a_core_meshed_apart_is_welded_and_the_elements_keep_their_order():
    nodes, elements, said = weld_pieces(*halves(BAR, CORE, NOWHERE))
    assert said.startswith("2 pieces welded at ")
    assert len(nodes) == len(BAR.nodes) and np.array_equal(nodes[elements], BAR.nodes[BAR.tetrahedra])


def test_nodes_of_pieces_apart_stay():
    for shift in ([0, 0, 0.0105], [0, 0.02, 0.01], [0.2, 0.02, 0.01]):  # apart, at an edge, at a corner
        nodes, tetrahedra = together((LAYER, [0, 0, 0]), (LAYER, shift))
        assert weld_pieces(nodes, tetrahedra)[2] == ""
        with warnings.catch_warnings(action="error"):
            check_seams("bar.vtu", TetMesh(nodes, tetrahedra))


OTHER = box([0.2, 0.02, 0.01], [15, 3, 2])
REFUSED = {
    "other triangles": ([(LAYER, [0, 0, 0]), (OTHER, [0, 0, 0.01])], "touch others and share no nodes"),
    "moved by a cell": ([(LAYER, [0, 0, 0]), (LAYER, [0.01, 0, 0.01])], "touch others and share no nodes"),
    "on a part": ([(LAYER, [0, 0, 0]), (box([0.03, 0.01, 0.01], [3, 1, 1]), [0.04, 0.005, 0.01])], "touch others"),
    "1 µm apart": ([(LAYER, [0, 0, 0]), (LAYER, [0, 0, 0.010001])], "touch others"),
    "overlap": ([(LAYER, [0, 0, 0]), (LAYER, [0, 0, 0.0098])], "overlap with other elements"),
    "one within": (
        [(BAR, [0, 0, 0]), (box([0.02, 0.01, 0.01], [2, 1, 1]), [0.05, 0.005, 0.005])],
        "overlap with other elements",
    ),
    "twice": ([(LAYER, [0, 0, 0]), (LAYER, [0, 0, 0])], "overlap with other elements"),
    "a corner": ([(LAYER, [0, 0, 0]), (LAYER, [0.199, 0.019, 0.009])], "overlap with other elements"),
}


@pytest.mark.parametrize("name", REFUSED)
@pytest.mark.parametrize("scale", [1.0, 1e3])
def test_parts_that_nothing_joins_are_refused(name, scale):
    parts, message = REFUSED[name]
    nodes, tetrahedra, _ = weld_pieces(*together(*parts))
    with pytest.raises(InputError, match=rf"^bar\.vtu: .*{message}"):
        check_seams("bar.vtu", TetMesh(scale * nodes, tetrahedra))


@pytest.mark.parametrize(
    ("mesh", "message"),
    [
        (
            together((LAYER, [0, 0, 0]), (LAYER, [0, 0, 0.01002])),
            "160 of 672 boundary faces are closer than 0.05 of their",
        ),
        (halves(BAR, UPPER, BAR.nodes[:, 0] < 0.1), "44 pairs of faces within one piece coincide .* taken for a cut"),
    ],
    ids=["20 µm apart", "half welded"],
)
def test_what_may_be_meant_is_warned_of(mesh, message):
    nodes, tetrahedra, said = weld_pieces(*mesh)
    assert said == "" and len(nodes) == len(mesh[0])
    with pytest.warns(UserWarning, match=f"^bar.vtu: {message}"):
        check_seams("bar.vtu", TetMesh(nodes, tetrahedra))


def test_a_body_of_two_layers_says_that_they_are_welded(tmp_path):
    nodes, tetrahedra = halves(BAR, UPPER, NOWHERE)
    meshio.write_points_cells(tmp_path / "bar.vtu", nodes, [("tetra", tetrahedra)])
    with pytest.warns(UserWarning, match=r"bar\.vtu: 2 pieces welded at 63 nodes, .*; give parts that are to stay"):
        mesh, *_ = build(File(path=str(tmp_path / "bar.vtu"), scale_m=1.0, young_pa=3000, poisson=0.3))
    assert len(mesh.nodes) == len(BAR.nodes)
