"""Pressing: responses, what they cost, and which contacts are refused."""

import numpy as np
import pandas as pd
import pytest

from palpate.benchmark import static_responses
from palpate.benchmark.presses import LOAD_COLUMNS
from palpate.benchmark.static_responses import inverted, load_responses, press, save_responses
from palpate.bodies.mesh import TetMesh
from palpate.bodies.refinement import finer, ten_nodes
from palpate.effects.patch_load import nodal_load
from palpate.errors import InputError, NotConverged
from palpate.solvers.equilibrium import Equilibrium


@pytest.fixture(scope="module")
def loads():
    rows = [[4, 44, 0.0, 0.1, -0.2, 0.0], [5, 44, 0.0, 0.2, -0.4, 0.02], [7, 41, 0.1, 0.0, -0.1, 0.0]]
    return pd.DataFrame(rows, columns=LOAD_COLUMNS)


@pytest.fixture(scope="module")
def responses(slab, loads):
    return press(slab, 1, loads, 1e-9)


def test_responses_are_the_equilibria_under_each_row(slab, loads, responses):
    for row, (_, load) in enumerate(loads.iterrows()):
        force = load[["force_x_n", "force_y_n", "force_z_n"]].to_numpy(dtype=float)
        nodal = nodal_load(slab, 1, int(load["contact"]), force, load["radius_m"])
        expected = Equilibrium(slab, 1).solve(nodal, 1e-9).x - slab.fine.nodes
        assert np.abs(responses.displacement[row] - expected).max() < 1e-12
    assert np.abs(responses.displacement[:, slab.anchors[1]]).max() == 0.0


def test_every_sample_says_what_it_cost(loads, responses):
    costs = responses.costs()
    assert list(costs.columns) == ["sample", "newton_iterations", "linear_solves", "residual", "seconds"]
    assert costs["sample"].tolist() == [4, 5, 7]
    assert (costs["residual"] <= 1e-9).all() and (costs["residual"] > 0).all()
    assert (costs["newton_iterations"] >= 2).all()
    assert (costs["linear_solves"] >= costs["newton_iterations"]).all()
    assert (costs["seconds"] > 0).all()


def test_progress_sees_every_row(slab, loads):
    seen = []

    def progress(rows):
        for row in rows:
            seen.append(row)
            yield row

    press(slab, 0, loads, 1e-6, progress)
    assert len(seen) == len(loads)


def test_contacts_that_cannot_be_pressed_are_refused(slab, loads):
    contact = slab.anchors[0][0]
    with pytest.raises(InputError, match=rf"^slab, contact {contact} is not a free surface node"):
        press(slab, 0, loads.assign(contact=contact), 1e-6)


def test_failure_names_the_sample_and_the_remedy(slab, loads, monkeypatch):
    def never(*_):
        raise NotConverged("it stopped", [1.0, 0.5])

    monkeypatch.setattr(static_responses.Equilibrium, "solve", never)
    with pytest.raises(
        NotConverged, match=r"^slab, sample 4: it stopped; lower the regime.s peak_of_size, .* \(anchors\)\.$"
    ) as failure:
        press(slab, 0, loads, 1e-6)
    assert failure.value.history == [1.0, 0.5]


def test_parts_are_joined_in_the_order_given(slab, loads, responses, tmp_path):
    paths = [tmp_path / f"fine_{i}.h5" for i in range(2)]
    save_responses(press(slab, 1, loads[:2], 1e-9), paths[0])
    save_responses(press(slab, 1, loads[2:], 1e-9), paths[1])
    joined = load_responses(paths)
    for name in ("sample", "displacement", "newton_iterations", "linear_solves", "residual", "least_det", "inverted"):
        assert np.array_equal(getattr(joined, name), getattr(responses, name)), name
    assert load_responses(paths[::-1]).sample.tolist() == [7, 4, 5]
    assert sorted(p.name for p in tmp_path.iterdir()) == ["fine_0.h5", "fine_1.h5"]


def test_quadratic_responses_are_those_of_ten_node_elements(slab, loads):
    """Also where the body lacks the level that their midpoints need, and from the level before or from rest."""
    for level in (0, 1):
        found = press(slab, level, loads, 1e-9, order=2)
        assert found.displacement.shape == (3, len(slab.levels[level].nodes), 3)
        problem = Equilibrium(finer(slab), level, 2)
        for row, (_, load) in enumerate(loads.iterrows()):
            force = load[["force_x_n", "force_y_n", "force_z_n"]].to_numpy(dtype=float)
            nodal = nodal_load(finer(slab), level, int(load["contact"]), force, load["radius_m"], 2)
            x = problem.solve(nodal, 1e-9).x
            expected = (x - problem.mesh.nodes)[: len(slab.levels[level].nodes)]
            assert np.abs(found.displacement[row] - expected).max() < 1e-7 * np.abs(expected).max()
            assert found.least_det[row] == pytest.approx(problem.least_det(x), rel=1e-6)
        assert found.inverted.tolist() == [0, 0, 0] and found.least_det.min() > 0.0


def test_an_inverted_element_is_counted_and_of_quadratic_elements_warned_of(slab, monkeypatch):
    """Linear ones by a force on one node that pushes it through the body."""
    rows = [[0, 44, -3.0, -3.0, -3.0, 0.0], [1, 44, 0.0, 0.1, -0.1, 0.0]]
    found = press(slab, 0, pd.DataFrame(rows, columns=LOAD_COLUMNS), 1e-8)
    assert found.least_det[0] < 0.0 < found.least_det[1]
    moved = TetMesh(slab.coarse.nodes + found.displacement[0], slab.coarse.tetrahedra)
    assert found.inverted.tolist() == [np.sum(moved.volumes <= 0.0), 0]
    monkeypatch.setattr(static_responses.Equilibrium, "least_det", lambda *_: -0.1)
    monkeypatch.setattr(static_responses, "inverted", lambda *_: 3)
    with pytest.warns(
        UserWarning, match=r"^bodies\.slab: in 1 of 1 samples an element is inverted, .* larger radius_m"
    ):
        press(slab, 0, pd.DataFrame(rows[1:], columns=LOAD_COLUMNS), 1e-6, order=2)


def test_points_of_quadratic_elements_are_counted_by_element(slab):
    """Turned inside out by moving one midpoint far away."""
    x = finer(slab).levels[1].nodes.copy()
    assert inverted(slab.coarse, x, 2) == 0
    midpoint = ten_nodes(slab.coarse)[7, 5]
    x[midpoint] += 0.2
    around = (ten_nodes(slab.coarse) == midpoint).any(axis=1).sum()
    assert 1 <= inverted(slab.coarse, x, 2) <= around
