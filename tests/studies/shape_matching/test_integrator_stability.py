"""Integrators grow by paper 3's eigenvalues, and become unstable at the step that these predict."""

import numpy as np
import pytest

from palpate.report.claims import CONFIRMED
from palpate.studies.shape_matching import claims, integrator_stability

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def table():
    return integrator_stability.measure([0.5])


def test_runs_grow_as_the_formulas_say(table):
    assert len(table) == 3 * 41
    assert table["h_over_sqrt_m_k"].agg(["min", "max"]).tolist() == pytest.approx([0.01, 100.0])
    assert np.abs(table["growth_measured"] / table["spectral_radius"] - 1).max() < 1e-4


def test_only_the_explicit_scheme_blows_up_and_where_it_states(table):
    assert {claim.verdict for claim in claims._integrators(table)} == {CONFIRMED}
    explicit = table["scheme"] == "symplectic_euler"
    assert table.loc[explicit, "limit_stated"].to_numpy() == pytest.approx(2.0, rel=1e-12)
    assert np.isinf(table.loc[~explicit, ["blow_up_measured", "limit_stated"]].to_numpy()).all()
