"""Nodal rotations of deformations whose rotation is known."""

import numpy as np
import pytest
from scipy.linalg import polar

from palpate.models.enrichment.detail_correction import NodalRotations


@pytest.mark.parametrize("angle", [0.0, 1e-6, 1.0, np.pi - 1e-6, np.pi, 5.0])
def test_a_rigid_motion_turns_every_node_alike(slab, rotation, angle):
    nodes, turn = slab.coarse.nodes, rotation(angle)
    found = NodalRotations(slab.coarse).at(nodes @ turn.T + [0.1, 0.2, -0.3] - nodes)
    assert np.abs(found - turn).max() < 1e-12


def test_an_affine_deformation_turns_by_its_polar_part(slab, rotation):
    nodes = slab.coarse.nodes
    f = rotation(2.0) @ np.array([[1.3, 0.2, 0.0], [0.1, 0.8, -0.1], [0.0, 0.1, 1.1]])
    found = NodalRotations(slab.coarse).at(nodes @ f.T - nodes)
    assert np.abs(found - polar(f)[0]).max() < 1e-12


def test_a_bent_bar_turns_along_its_length(beam):
    """Bent to a circle's arc the cross-section at height z turns by z/radius about y."""
    radius, nodes = 0.3, beam.fine.nodes
    angle = nodes[:, 2] / radius
    x, z = (radius - nodes[:, 0]) * np.cos(angle), (radius - nodes[:, 0]) * np.sin(angle)
    found = NodalRotations(beam.fine).at(np.column_stack([radius - x, nodes[:, 1], z]) - nodes)
    middle = (nodes[:, 2] > 0.02) & (nodes[:, 2] < 0.18)
    turned = np.arctan2(found[:, 0, 2], found[:, 2, 2])
    assert np.abs(turned - angle)[middle].max() < 0.03
    assert np.abs(np.swapaxes(found, 1, 2) @ found - np.eye(3)).max() < 1e-12
    assert np.abs(np.linalg.det(found) - 1.0).max() < 1e-12


def test_the_mean_around_a_node_is_weighted_by_volume(slab):
    """Moving one node turns its neighbours by the polar part of what their elements say together."""
    mesh, moved = slab.coarse, np.zeros_like(slab.coarse.nodes)
    moved[44] = [0.02, -0.03, 0.05]
    corners = mesh.nodes[mesh.tetrahedra]
    rest, now = ((c[:, 1:] - c[:, :1]).swapaxes(1, 2) for c in (corners, corners + moved[mesh.tetrahedra]))
    f = now @ np.linalg.inv(rest)
    found = NodalRotations(mesh).at(moved)
    for node in (44, 41, 0, 30):
        around = (mesh.tetrahedra == node).any(axis=1)
        mean = np.average(f[around], axis=0, weights=mesh.volumes[around])
        assert np.abs(found[node] - polar(mean)[0]).max() < 1e-11
