"""The law's own limit: where a liver snaps under a finger, and where it does not."""

import numpy as np
import pandas as pd
import pytest
from fixtures.bodies import LIVER

from palpate.bodies.make_body import make_body
from palpate.bodies.refinement import finer
from palpate.effects.patch_load import nodal_load
from palpate.errors import InputError, NotConverged
from palpate.solvers.equilibrium import Equilibrium
from palpate.studies.tradeoff import truth_table as module
from palpate.studies.tradeoff.figures.scene_rows import jumps
from palpate.studies.tradeoff.truth_table import LIMIT_POINTS, limit_points

SNAPS, STANDS = 7, 34


@pytest.fixture(scope="module")
def liver():
    return make_body("liver", LIVER)


@pytest.mark.slow
def test_one_place_of_the_liver_snaps_and_another_does_not(liver):
    table = limit_points(liver, 0.012, [SNAPS, STANDS], [0.1, 0.2, 0.25, 0.27, 0.29, 0.31, 0.33])
    assert list(table.columns) == LIMIT_POINTS.columns and table["converged"].all()
    found = jumps(table)
    assert found["contact"].tolist() == [SNAPS]
    before, after = found.loc[0, ["pressure_of_young_before", "pressure_of_young_after"]]
    assert (before, after) == (0.29, 0.31)
    assert found.loc[0, "peak_of_size_before"] == pytest.approx(0.109, abs=0.005)
    assert found.loc[0, "peak_of_size_after"] == pytest.approx(0.153, abs=0.005)
    assert table["least_det"][table["contact"] == STANDS].min() > 0.7


@pytest.mark.slow
def test_rows_are_equilibria_under_the_pressure(beam):
    """By another way: from rest, under a force that makes that pressure."""
    table = limit_points(beam, 0.01, 2, [0.05, 0.1])
    assert table["contact"].nunique() == 2
    row, whole = table.iloc[1], finer(beam)
    contact, newtons = int(row["contact"]), 0.1 * 3000.0 * np.pi * 0.01**2 / 2
    problem = Equilibrium(whole, 1, 2)
    load = nodal_load(whole, 1, contact, -newtons * beam.fine.normals[contact], 0.01, 2)
    x = problem.solve(load, 1e-8).x
    peak = np.linalg.norm(x - problem.mesh.nodes, axis=1).max()
    assert row["peak_of_size"] == pytest.approx(peak / beam.fine.size, rel=1e-4)
    assert row["least_det"] == pytest.approx(problem.least_det(x), rel=1e-3)


def test_a_contact_ends_where_no_equilibrium_is_found(beam, monkeypatch):
    solve = Equilibrium.solve

    def failing(self, load, tolerance, start=None):
        if np.abs(load).sum() > limit:
            raise NotConverged("it stopped", [1.0])
        return solve(self, load, tolerance, start)

    limit = 0.07 * 3000.0 * np.pi * 0.01**2 / 2 * 1.8  # the sum over axes is at most √3 times the force
    monkeypatch.setattr(module.Equilibrium, "solve", failing)
    table = limit_points(beam, 0.01, 1, [0.02, 0.04, 0.6, 0.8])
    assert table["converged"].tolist() == [True, True, False]
    assert np.isnan(table["peak_of_size"].iloc[2])
    assert jumps(table)["pressure_of_young_after"].tolist() == [0.6]


def test_jumps_are_steps_of_twice_the_slope():
    pressure, peak = [0.1, 0.2, 0.3, 0.4], [0.01, 0.021, 0.045, 0.055]
    table = pd.DataFrame({"body": "liver", "contact": 3, "pressure_of_young": pressure, "peak_of_size": peak})
    found = jumps(table.assign(least_det=[0.9, 0.8, 0.3, 0.25], converged=True))
    assert found.to_numpy().tolist() == [["liver", 3, 0.2, 0.3, 0.021, 0.045, 0.3]]
    assert not len(jumps(table.assign(peak_of_size=[0.01, 0.02, 0.03, 0.04], least_det=0.5, converged=True)))


def test_what_cannot_be_pressed_is_refused(beam):
    with pytest.raises(InputError, match=r"limit_points\.contacts of beam: contact 99999 is not a free surface node"):
        limit_points(beam, 0.01, [99999])
    with pytest.raises(InputError, match="radius_m is 12"):
        limit_points(beam, 12.0, 1)
