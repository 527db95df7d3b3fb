"""Integrators grow by paper 3's eigenvalues, and become unstable at the step that these predict."""

import numpy as np
import pytest

from palpate.report.claims import CONFIRMED
from palpate.studies.shape_matching import claims, integrator_stability
from palpate.studies.shape_matching.integrator_stability import explicit_radius, goal_radius, implicit_radius

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def table():
    return integrator_stability.measure([0.5])


def test_formulas_are_the_matrices_spectral_radii():
    def radius(matrix):
        return np.abs(np.linalg.eigvals(matrix)).max()

    for s in (0.01, 0.7, 1.9, 2.1, 30.0):  # k = m = 1
        assert explicit_radius(s) == pytest.approx(radius([[1, -s], [s, 1 - s**2]]), rel=1e-12)
        assert implicit_radius(s) == pytest.approx(radius(np.linalg.inv([[1, s], [-s, 1]])), rel=1e-12)
        for alpha in (0.1, 0.5, 1.0):
            assert goal_radius(alpha) == pytest.approx(radius([[1, -alpha / s], [s, 1 - alpha]]), rel=1e-9)


def test_runs_grow_as_the_formulas_say(table):
    assert len(table) == 3 * 41
    assert table["h_over_sqrt_m_k"].agg(["min", "max"]).tolist() == pytest.approx([0.01, 100.0])
    assert np.abs(table["growth_measured"] / table["spectral_radius"] - 1).max() < 1e-4


def test_only_the_explicit_scheme_blows_up_and_where_it_states(table):
    assert {claim.verdict for claim in claims._integrators(table)} == {CONFIRMED}
    explicit = table["scheme"] == "symplectic_euler"
    assert table.loc[explicit, "limit_stated"].to_numpy() == pytest.approx(2.0, rel=1e-12)
    assert np.isinf(table.loc[~explicit, ["blow_up_measured", "limit_stated"]].to_numpy()).all()
