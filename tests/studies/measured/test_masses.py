"""Mass matrices integrate products of their shape functions exactly."""

import numpy as np
import pytest

from palpate.studies.measured.specimen import mass_matrix


@pytest.mark.parametrize("order", [1, 2])
def test_products_of_polynomials_are_exact(box, order):
    mesh = box((2, 3, 2), (1.0, 2.0, 0.5), jitter=0.2)
    x = mesh.nodes if order == 1 else np.vstack([mesh.nodes, mesh.nodes[mesh.edges].mean(axis=1)])
    masses = mass_matrix(mesh, np.full(len(mesh.tetrahedra), 3.0), order)
    assert masses.sum() == pytest.approx(3.0)  # a volume of 1
    f, g = x[:, 0] ** order, (x[:, 1] * x[:, 2] if order == 2 else x[:, 1])
    # ∫ x^k over (0, 1), ∫ y over (0, 2), ∫ z over (0, 0.5)
    across = 2.0 * 0.125 if order == 2 else 2.0 * 0.5
    assert f @ masses @ g == pytest.approx(3.0 * across / (order + 1))


def test_densities_are_those_of_the_elements(box):
    mesh = box((2, 1, 1), (1.0, 1.0, 1.0))
    right = mesh.nodes[mesh.tetrahedra].mean(axis=1)[:, 0] > 0.5
    assert mass_matrix(mesh, np.where(right, 5.0, 1.0), 2).sum() == pytest.approx(3.0)
