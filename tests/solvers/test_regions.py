"""Equilibria of bodies whose regions differ in stiffness, by linear and quadratic elements."""

import numpy as np
import pytest

from palpate.bodies.body import nest
from palpate.bodies.box import box
from palpate.bodies.make_body import make_body
from palpate.bodies.material import Material, Tissue
from palpate.effects.patch_load import nodal_load
from palpate.effects.surface_integrals import midpoints
from palpate.solvers.equilibrium import Equilibrium

LENGTH, YOUNG, STRESS = 0.2, 3000.0, 300.0
ELEMENTS = [(0, 1), (2, 1), (0, 2), (1, 2)]
"""Levels, and orders of elements."""


def two_layers(contrast: float):
    """Make a bar along x, held at its beginning, whose second half is stiffer; with ν = 0 each layer only stretches."""
    mesh = box([LENGTH, 0.04, 0.04], [6, 2, 2])
    middles = mesh.nodes[mesh.tetrahedra].mean(axis=1)
    materials = tuple(Material(YOUNG * factor, 0.0, 1000.0) for factor in (1.0, contrast))
    held = np.flatnonzero(mesh.nodes[:, 0] == 0.0)
    return nest("bar", mesh, 2, held, materials[0], regions=Tissue(materials, (middles[:, 0] > LENGTH / 2).astype(int)))


def pulled(mesh, order: int) -> np.ndarray:
    """Integrate STRESS on the end of the bar with the shape functions of the elements: nodal forces (n, 3) [N]."""
    ends = mesh.triangles[(mesh.nodes[mesh.triangles][..., 0] > LENGTH - 1e-9).all(axis=1)]
    a, b, c = (mesh.nodes[ends[:, i]] for i in range(3))
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    nodes = ends if order == 1 else midpoints(mesh, ends)
    load = np.zeros((len(mesh.nodes) + (len(mesh.edges) if order == 2 else 0), 3))
    np.add.at(load[:, 0], nodes.ravel(), np.repeat(STRESS * areas / 3, 3))
    return load


@pytest.mark.parametrize(("contrast", "tolerance"), [(1.0, 1e-6), (10.0, 1e-6), (1e4, 1e-3)])
@pytest.mark.parametrize(("level", "order"), ELEMENTS)
def test_two_layers_stretch_as_springs_in_a_row(contrast, tolerance, level, order):
    """Under a dead load F and with ν = 0 the law is P = E (s − 1), so each layer stretches by F/(A E), however far."""
    body = two_layers(contrast)
    problem = Equilibrium(body, level, order)
    x = problem.solve(pulled(body.levels[level], order), 1e-8).x
    rest = problem.mesh.nodes
    for begin, young in ((0.0, YOUNG), (LENGTH / 2, YOUNG * contrast)):
        layer = (rest[:, 0] > begin - 1e-9) & (rest[:, 0] < begin + LENGTH / 2 + 1e-9)
        stretch = np.ptp(x[layer, 0]) / (LENGTH / 2) - 1.0
        assert stretch == pytest.approx(STRESS / young, rel=tolerance)
    assert np.abs(x[:, 1:] - rest[:, 1:]).max() < 1e-9


def test_layers_side_by_side_share_a_load_by_their_moduli():
    """Layers along z act in parallel, and the bar bends: a check of which element is which."""
    mesh = box([LENGTH, 0.02, 0.04], [20, 2, 4])
    stiff = mesh.nodes[mesh.tetrahedra].mean(axis=1)[:, 2] > 0.02
    materials = (Material(YOUNG, 0.0, 1000.0), Material(10 * YOUNG, 0.0, 1000.0))
    held = np.flatnonzero(mesh.nodes[:, 0] == 0.0)
    body = nest("bar", mesh, 1, held, materials[0], regions=Tissue(materials, stiff.astype(int)))
    load = 1e-4 * pulled(body.levels[0], 2)
    problem = Equilibrium(body, 0, 2)
    moved = problem.solve(load, 1e-8).x - problem.mesh.nodes
    # between two cross-sections away from the ends, where the traction is not the one of a beam
    ends = []
    for place in (0.25 * LENGTH, 0.75 * LENGTH):
        section = np.isclose(problem.mesh.nodes[:, 0], place)
        ends.append(np.polyfit(problem.mesh.nodes[section, 2] - 0.02, moved[section, 0], 1))
    slope, middle = ends[1] - ends[0]
    # composite beam under an axial force at half its height: Σ E A, Σ E S and Σ E I of the layers, of unit width
    height = 0.02
    area, first, second = (YOUNG * (height**k / k) * np.array([(-1.0) ** (k - 1), 10.0]).sum() for k in (1, 2, 3))
    strain, curvature = np.linalg.solve([[area, first], [first, second]], [1e-4 * STRESS * 2 * height, 0.0])
    assert middle == pytest.approx(strain * LENGTH / 2, rel=0.005)
    assert slope == pytest.approx(curvature * LENGTH / 2, rel=0.005)


@pytest.fixture(scope="module")
def organ():
    def make(contrast: float):
        entry = {"kind": "liver", "length_m": 0.2, "refinements": 2, "young_pa": YOUNG, "poisson": 0.3}
        entry |= {"density_kg_m3": 1000, "anchors": {"sphere": {"center_m": [-0.03, 0.05, 0.03], "radius_m": 0.04}}}
        sphere = {"center_m": [0.02, -0.02, 0.01], "radius_m": 0.015}
        return make_body("liver", entry | {"regions": {"tumour": {"sphere": sphere, "young_pa": YOUNG * contrast}}})

    return make


@pytest.mark.parametrize(("level", "order", "most"), [(2, 1, 1.6), (1, 2, 2.8)])
def test_a_contrast_of_ten_thousand_takes_few_more_products(organ, level, order, most):
    """Coarse elements have the materials of fine ones, so that multigrid does not suffer from the interface."""
    products, depths = {}, {}
    for contrast in (1.0, 1e4):
        body = organ(contrast)
        contact = body.coarse.surface[np.argmax(body.coarse.nodes[body.coarse.surface] @ [0.1, -0.1, 1.0])]
        normal = body.fine.normals[contact]
        load = nodal_load(body, level, int(contact), -0.1 * normal, 0.012, order)
        problem = Equilibrium(body, level, order)
        solution = problem.solve(load, 1e-8)
        assert solution.history[-1] <= 1e-8
        products[contrast] = solution.products
        depths[contrast] = float(np.vdot(load, solution.x - problem.mesh.nodes))
    assert products[1e4] <= most * products[1.0]
    assert depths[1e4] < depths[1.0]
