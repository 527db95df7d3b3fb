"""Warped linear responses: rotations are found and applied exactly, and turn with the body as they must."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from palpate.bodies.mesh import TetMesh
from palpate.errors import InputError
from palpate.models.linear_fem import LinearFem
from palpate.models.warped_compliance import NodalSpins, WarpedResponse, turn, warp
from palpate.solvers.compliance import Compliance

FORCE = np.array([0.1, 0.2, -0.4])


@pytest.fixture(scope="module")
def spins():
    """Rotation vectors, among them none, one of 1e-5 on either side of the series, and more than half a turn."""
    random = np.random.default_rng(0).normal(size=(20, 3))
    random[0] = 0.0
    random[1] *= 0.99e-4 / np.linalg.norm(random[1])
    random[2] *= 1.01e-4 / np.linalg.norm(random[2])
    random[3] *= 4.0 / np.linalg.norm(random[3])
    return random


def test_vectors_are_turned(spins):
    vectors = np.random.default_rng(1).normal(size=spins.shape)
    assert np.abs(turn(spins, vectors) - Rotation.from_rotvec(spins).apply(vectors)).max() < 1e-14


def test_a_warp_is_the_mean_of_the_rotations_on_the_way(spins):
    vectors = np.random.default_rng(1).normal(size=spins.shape)
    points, weights = np.polynomial.legendre.leggauss(20)
    on_the_way = [Rotation.from_rotvec((p + 1) / 2 * spins).apply(vectors) for p in points]
    assert np.abs(warp(spins, vectors) - np.tensordot(weights / 2, on_the_way, 1)).max() < 1e-13


def test_spins_of_a_linear_field_are_half_its_curl(db):
    """Also at the surface, and whatever is stretched or sheared."""
    gradient = np.random.default_rng(0).normal(size=(3, 3))
    expected = 0.5 * np.array(
        [gradient[2, 1] - gradient[1, 2], gradient[0, 2] - gradient[2, 0], gradient[1, 0] - gradient[0, 1]]
    )
    found = NodalSpins(TetMesh(db.coarse_nodes, db.coarse_tetrahedra)).of(db.coarse_nodes @ gradient.T)
    assert np.abs(found - expected).max() < 1e-12


def test_small_loads_are_linear_and_the_rest_is_of_second_order(slab_case):
    case, test, _ = slab_case
    linear, warped = LinearFem(case.response), WarpedResponse(case.meshes, case.response)
    contact, off = int(test.contact[0]), []
    for factor in (1e-3, 1e-4):
        expected = linear.answer(contact, factor * FORCE)[0]
        off.append(np.abs(warped.answer(contact, factor * FORCE)[0] - expected).max() / np.abs(expected).max())
    assert off[0] / off[1] == pytest.approx(10.0, rel=0.05)


def test_a_turned_body_answers_turned(slab_case, rotation):
    """Turning the rest shape, its stored responses and the force turns the answer and the rotations."""
    case, test, _ = slab_case
    db, response, q = case.meshes, case.response, rotation(0.7)
    turned = [np.einsum("ij,cjnk,lk->cinl", q, getattr(response, name), q) for name in ("fine", "restricted", "coarse")]
    there = WarpedResponse(replace(db, coarse_nodes=db.coarse_nodes @ q.T), Compliance(response.contacts, *turned))
    here, contact = WarpedResponse(db, response), int(test.contact[0])
    for found, expected in zip(there.answer(contact, q @ FORCE), here.answer(contact, FORCE), strict=True):
        assert np.abs(found - expected @ q.T).max() < 1e-12


def test_the_force_turns_back_with_its_contact(slab_case):
    """Where the contact alone turns, by a right angle about z, the body answers the force as seen from there."""
    case, test, _ = slab_case
    method, contact = WarpedResponse(case.meshes, case.response), int(test.contact[0])
    row = case.response.row(contact)
    method._spins[row] = 0.0
    force = np.array([1.0, 0.0, 0.0])
    method._spins[row, 0, contact] = [0.0, 0.0, np.pi / 2]
    found = method.answer(contact, force)[0]
    assert np.abs(found - LinearFem(case.response).answer(contact, np.array([0.0, -1.0, 0.0]))[0]).max() < 1e-12


def test_a_contact_that_is_not_prepared_is_refused(slab_case):
    case = slab_case[0]
    with pytest.raises(InputError, match="not a free surface node"):
        WarpedResponse(case.meshes, case.response).answer(int(case.body.anchors[0][0]), FORCE)


def test_under_small_loads_each_node_is_turned_by_half_its_rotation(slab_case):
    """A displacement grows with the load, and so does its rotation: on the way there it was half as large."""
    case, test, _ = slab_case
    contact, force = int(test.contact[0]), 1e-3 * FORCE
    answer, spins = WarpedResponse(case.meshes, case.response).answer(contact, force)
    row = case.response.row(contact)
    there = NodalSpins(TetMesh(case.meshes.coarse_nodes, case.meshes.coarse_tetrahedra))
    back = -there.of(np.tensordot(force, case.response.restricted[row], 1))[contact]
    local = LinearFem(case.response).answer(contact, force + np.cross(back, force))[0]
    beyond = answer - local
    assert np.abs(beyond - 0.5 * np.cross(spins, local)).max() < 0.05 * np.abs(beyond).max()
