"""Published values are met, from values in the repository, and what is left is said."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.sparse import block_array
from skfem import (
    Basis,
    BilinearForm,
    ElementTriP1,
    ElementTriP2,
    ElementVector,
    FacetBasis,
    LinearForm,
    MeshTri,
    condense,
    solve,
)
from skfem.helpers import ddot, div, sym_grad

from palpate.benchmark.richardson import number_limits
from palpate.bodies.material import Material
from palpate.effects.law import fault, law_of
from palpate.studies.outside import compare, hanging_bar, prisms
from palpate.studies.outside.supported import Supported, block

FOLDER = Path(compare.__file__).parent


@pytest.fixture(scope="module")
def table():
    files = SimpleNamespace(published=FOLDER / "published.yaml", displacements=FOLDER / "hanging_bar.csv")
    return compare.compare_with_published(files).set_index("case")


@pytest.mark.slow
def test_fenicsx_is_met_node_for_node(table):
    """Displacements are stored to 1e-12 m; the equilibrium to 1e-9 of the load."""
    assert table.loc["bar_nodes", "difference"] < 1e-10
    assert table.loc[["bar_tip", "bar_nodes", "squeezed", "stretched"], "ours"].to_numpy() == pytest.approx(
        table.loc[["bar_tip", "bar_nodes", "squeezed", "stretched"], "published"].to_numpy(), rel=1e-8
    )


def test_the_bars_grid_fills_its_block():
    mesh = hanging_bar.grid(hanging_bar.CELLS, hanging_bar.SIZES_M)
    assert (len(mesh.nodes), len(mesh.tetrahedra)) == (833, 2880) and mesh.volumes.min() > 0.0
    assert mesh.volumes.sum() == pytest.approx(0.576, rel=1e-6)
    assert len(mesh.triangles) == 4 * (6 * 6 + 2 * 6 * 16)  # neighbours share their faces: the rest are two a square


@pytest.mark.slow
def test_the_bars_limit_is_above_the_published_meshes(table):
    """The published hexahedra rise from 40.05 to 43.68 mm: by 0.28 mm at last, to two thirds of the length."""
    assert 43.7 < table.loc["bar_limit", "ours"] < 44.3
    assert table.loc["bar_energy", "ours"] > table.loc["bar_energy", "published"]


@pytest.mark.slow
def test_limits_are_near_published_ones(table):
    near = ["torsion", "in_plane", "in_plane_pair", "cook_free"]
    assert (table.loc[near, "difference"].abs() < table.loc[near, "own_error"] + 4e-4).all()


def test_the_prisms_torsion_is_saint_venants():
    """His series: 1/3 − 64/π⁵ Σ tanh(n π/2) / n⁵ over odd n."""
    odd = np.arange(1, 40, 2)
    exact = 1.0 / 3.0 - 64.0 / np.pi**5 * np.sum(np.tanh(0.5 * np.pi * odd) / odd**5)
    errors = [prisms.torsion_constant(cells) - exact for cells in (4, 8)]
    assert 0.0 < errors[1] < 5e-5 and 8.0 < errors[0] / errors[1] < 20.0


def taylor_hood(cells):
    """The middle of the end of Cook's nearly incompressible membrane [mm] in the plane, by scikit-fem."""
    grid = MeshTri.init_tensor(*2 * [np.linspace(0.0, 1.0, cells + 1)])
    x, y = grid.p
    mesh = MeshTri(np.vstack([48.0 * x, 44.0 * x + y * (44.0 - 28.0 * x)]), grid.t)
    moves = Basis(mesh, ElementVector(ElementTriP2()), intorder=4)
    presses = Basis(mesh, ElementTriP1(), intorder=4)
    shear = BilinearForm(lambda u, v, w: 2.0 * 0.375 * ddot(sym_grad(u), sym_grad(v))).assemble(moves)
    volume = BilinearForm(lambda u, q, w: div(u) * q).assemble(moves, presses)
    bulk = BilinearForm(lambda p, q, w: -p * q / 7500.0).assemble(presses)
    end = FacetBasis(mesh, ElementVector(ElementTriP2()), facets=mesh.facets_satisfying(lambda x: x[0] > 48.0 - 1e-9))
    load = LinearForm(lambda v, w: v[1] / 16.0).assemble(end)
    matrix = block_array([[shear, volume.T], [volume, bulk]], format="csr")
    wall = moves.get_dofs(lambda x: x[0] < 1e-9).all()
    found = solve(*condense(matrix, np.concatenate([load, np.zeros(presses.N)]), D=wall))[: moves.N]
    return (moves.probes(np.array([[48.0], [52.0]])) @ found)[1]


@pytest.mark.slow
def test_cooks_nearly_incompressible_membrane_is_that_of_taylor_hood_elements(table):
    """The published 16.4326 mm is 0.1 % below both."""
    limit, off = number_limits(np.array([[taylor_hood(cells)] for cells in (8, 16, 32)]))
    row = table.loc["cook_incompressible"]
    assert abs(row["ours"] - limit[0]) < off[0] + row["own_error"] * row["ours"]
    assert row["ours"] > row["published"]


@pytest.mark.slow
def test_cooks_published_tip_is_that_of_free_faces(table):
    assert abs(table.loc["cook_free", "difference"]) < 6e-4
    assert table.loc["cook_plane_strain", "difference"] == pytest.approx(-0.039, abs=0.001)


def test_the_isochoric_law_is_a_law_and_its_energy_that_of_its_formula():
    law = law_of(prisms.ISOCHORIC)
    assert not fault(law)
    mu, lam, s, out = 2.0, 3.0, np.array([1.3, 1.1, 0.8]), (np.zeros(3), np.zeros((3, 3)))
    volume = s.prod()
    assert law.shape(s, mu, *out) == pytest.approx(0.5 * mu * (volume ** (-2 / 3) * (s @ s) - 3.0))
    for i in range(3):
        ends = [law.shape(s + h * np.eye(3)[i], mu, np.zeros(3), np.zeros((3, 3))) for h in (1e-6, -1e-6)]
        assert out[0][i] == pytest.approx((ends[0] - ends[1]) / 2e-6, rel=1e-6)
    change = np.zeros(2)
    kappa = lam + 2.0 * mu / 3.0
    assert law.volume(0.9, mu, lam, change) == pytest.approx(0.25 * kappa * (0.81 - 1.0 - 2.0 * np.log(0.9)))


def test_what_is_held_stays_and_what_is_free_is_in_balance():
    """A bar on rollers that is pulled by T stretches by T/E and thins by ν T/E, in the linear case exactly."""
    rollers = Supported(block([2, 1, 1], lambda p: p), Material(4.0, 0.3, 1.0), lambda p: np.abs(p) < 1e-9)
    rollers.press(lambda p: p[:, 0] > 1.0 - 1e-9, np.array([0.4, 0.0, 0.0]))
    assert rollers.load.sum(axis=0) == pytest.approx([0.4, 0.0, 0.0])
    assert rollers.respond() == pytest.approx(rollers.nodes * [0.1, -0.03, -0.03], abs=1e-12)
    assert rollers.settle() == pytest.approx(rollers.nodes * [0.1, -0.03, -0.03], abs=1e-8)
    assert rollers.masses().sum() == pytest.approx(1.0)
