"""Errors by hand, and the table's columns and means."""

import numpy as np
import pytest

from palpate.benchmark.accuracy import errors, patch_nodes, truth_errors
from palpate.errors import InputError


def test_errors_by_hand():
    reference = np.array([[3.0, 4.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]])
    predicted = reference + np.array([[0.0, 0.0, 1.0], [2.0, 0.0, 0.0], [0.0, -2.0, 0.0]])
    found = errors(predicted, reference)
    assert found.rmse_m == pytest.approx(np.sqrt((1 + 4 + 4) / 3))
    assert found.rmse_of_peak == pytest.approx(found.rmse_m / 5)
    assert found.max_of_peak == pytest.approx(2 / 5)
    assert found.p95_of_peak == pytest.approx(2 / 5)
    assert errors(reference, reference) == (0, 0, 0, 0)
    with pytest.raises(InputError, match="the reference moves nowhere"):
        errors(predicted, np.zeros((3, 3)))


def test_errors_against_the_truth_by_hand():
    truth = np.array([[3.0, 4.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0], [0.0, 2.0, 0.0]])
    predicted = truth + np.array([[0.0, 0.0, 1.0], [2.0, 0.0, 0.0], [0.0, -2.0, 0.0], [0.0, 0.0, 0.0]])
    found = truth_errors(predicted, truth, np.array([True, True, False, False]))
    assert found.rmse_of_peak == pytest.approx(np.sqrt((1 + 4 + 4) / 4) / 5)
    assert found.relative_l2 == pytest.approx(np.sqrt((1 + 4 + 4) / (25 + 1 + 4)))
    assert found.patch_rms_of_peak == pytest.approx(np.sqrt((1 + 4) / 2) / 5)  # of the whole peak, not of the patch's
    assert found.patch_max_of_peak == pytest.approx(2 / 5) == found.max_of_peak
    last = truth_errors(predicted, truth, np.array([False, False, False, True]))
    assert last.patch_rms_of_peak == last.patch_max_of_peak == 0
    nothing = truth_errors(np.zeros((4, 3)), truth, np.array([True, False, False, False]))
    assert nothing.relative_l2 == nothing.patch_max_of_peak == nothing.patch_rms_of_peak == 1


def test_the_patch_is_on_the_side_that_is_pressed(box):
    """A plate of 2 mm: a disc of 12 mm reaches its other side, whose nodes are not pressed."""
    mesh = box([10, 10, 1], [0.1, 0.1, 0.002])
    contact = int(np.argmin(np.linalg.norm(mesh.nodes - [0.05, 0.05, 0.002], axis=1)))
    nodes = mesh.nodes[mesh.surface[patch_nodes(mesh, contact, 0.012)]]
    assert len(nodes) == 5 and np.allclose(nodes[:, 2], 0.002)
    assert np.linalg.norm(nodes - mesh.nodes[contact], axis=1).max() <= 0.012
    assert mesh.surface[patch_nodes(mesh, contact, 0.0)].tolist() == [contact]


def test_errors_do_not_depend_on_axes_or_units():
    random = np.random.default_rng(0)
    reference, predicted = random.normal(size=(2, 30, 3))
    turn = np.linalg.qr(random.normal(size=(3, 3)))[0]
    here, there = errors(predicted, reference), errors(1e3 * predicted @ turn, 1e3 * reference @ turn)
    assert there.rmse_m == pytest.approx(1e3 * here.rmse_m)
    assert there[1:] == pytest.approx(here[1:])
