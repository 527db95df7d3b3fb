"""Pressing: responses, what they cost, and which contacts are refused."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from palpate.benchmark import static_responses
from palpate.benchmark.database import read, write
from palpate.benchmark.presses import LOAD_COLUMNS, samples_in
from palpate.benchmark.static_responses import Responses, assemble, press
from palpate.bodies.mesh import TetMesh
from palpate.bodies.refinement import finer
from palpate.errors import InputError, NotConverged
from palpate.solvers.equilibrium import Equilibrium


@pytest.fixture(scope="module")
def three_loads():
    rows = [[4, 44, 0.0, 0.1, -0.2, 0.0], [5, 44, 0.0, 0.2, -0.4, 0.02], [7, 41, 0.1, 0.0, -0.1, 0.0]]
    return pd.DataFrame(rows, columns=LOAD_COLUMNS)


@pytest.fixture(scope="module")
def pressed_slab(slab, three_loads):
    return press(slab, 1, three_loads, 1e-9)


def test_responses_are_the_equilibria_under_each_row(slab, three_loads, pressed_slab):
    for row, sample in enumerate(samples_in(three_loads)):
        expected = Equilibrium(slab, 1).solve(sample.nodal(slab, 1), 1e-9).x - slab.fine.nodes
        assert np.abs(pressed_slab.displacement[row] - expected).max() < 1e-12
    assert np.abs(pressed_slab.displacement[:, slab.anchors[1]]).max() == 0.0


def test_every_sample_says_what_it_cost(three_loads, pressed_slab):
    costs = pressed_slab.costs()
    assert list(costs.columns) == ["sample", "newton_iterations", "linear_solves", "residual", "seconds"]
    assert costs["sample"].tolist() == [4, 5, 7]
    assert (costs["residual"] <= 1e-9).all() and (costs["residual"] > 0).all()
    assert (costs["newton_iterations"] >= 2).all()
    assert (costs["linear_solves"] >= costs["newton_iterations"]).all()
    assert (costs["seconds"] > 0).all()


def test_a_failure_names_the_contact_or_the_sample_and_the_remedy(slab, three_loads, monkeypatch):
    contact = slab.anchors[0][0]
    with pytest.raises(InputError, match=rf"^slab, contact {contact} is not a free surface node"):
        press(slab, 0, three_loads.assign(contact=contact), 1e-6)

    def never(*_):
        raise NotConverged("it stopped", [1.0, 0.5])

    monkeypatch.setattr(static_responses.Equilibrium, "solve", never)
    with pytest.raises(
        NotConverged, match=r"^slab, sample 4: it stopped; lower the regime.s peak_of_size, .* \(anchors\)\.$"
    ) as failure:
        press(slab, 0, three_loads, 1e-6)
    assert failure.value.history == [1.0, 0.5]


def test_quadratic_responses_are_those_of_ten_node_elements(slab, three_loads):
    """Also where the body lacks the level that their midpoints need, and from the level before or from rest."""
    for level in (0, 1):
        found = press(slab, level, three_loads, 1e-9, order=2)
        assert found.displacement.shape == (3, len(slab.levels[level].nodes), 3)
        problem = Equilibrium(finer(slab), level, 2)
        for row, sample in enumerate(samples_in(three_loads)):
            x = problem.solve(sample.nodal(finer(slab), level, 2), 1e-9).x
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


@pytest.fixture
def simulated(body):
    random = np.random.default_rng(3)
    free = np.setdiff1d(body.coarse.surface, body.anchors[0])
    numbers = {"sample": range(4), "contact": free[:4]}
    loads = pd.DataFrame({**numbers, "force_x_n": 1.0, "force_y_n": 0.0, "force_z_n": [1.0, 2, 3, 4]})

    def responses(mesh, seconds):
        ones = np.ones(4)
        moved = random.normal(size=(4, *mesh.nodes.shape))
        return Responses(np.arange(4), moved, ones, ones, 1e-11 * ones, seconds * ones, ones, 0 * ones)

    return loads, responses(body.fine, 3.0), responses(body.coarse, 0.5)


def test_paper_samples_are_the_fine_ones_at_coarse_nodes_and_live_ones_the_coarse_simulation(body, simulated, tmp_path):
    loads, fine, coarse = simulated
    db = assemble(body, loads, fine, coarse, "abc")
    assert np.array_equal(db.coarse("paper"), fine.displacement[:, : len(body.coarse.nodes)])
    assert np.array_equal(body.fine.nodes[: len(body.coarse.nodes)], body.coarse.nodes)
    assert np.array_equal(db.coarse("live"), coarse.displacement) and db.seconds.tolist() == [3.5] * 4  # of both meshes
    write(db, tmp_path / "database.h5")
    assert np.array_equal(read(tmp_path / "database.h5").fine, db.fine)
    slopes = np.array([[1.0, 2, 0], [0, 1, 3], [1, 0, 1]])  # interpolation to the surface keeps linear fields
    assert np.abs(db.prolongation @ (body.coarse.nodes @ slopes) - db.nodes_fine_surface @ slopes).max() < 1e-14


def test_responses_to_other_loads_or_of_other_meshes_are_refused(body, simulated):
    loads, fine, coarse = simulated
    for name, parts in (
        ("fine", (replace(fine, sample=fine.sample + 1), coarse)),
        ("coarse", (fine, replace(coarse, sample=coarse.sample[:2]))),
        ("fine", (coarse, coarse)),
    ):
        with pytest.raises(InputError, match=f"the {name} responses are not those to the loads"):
            assemble(body, loads, *parts, "abc")
