"""Markers move with the surface that they are glued to."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from palpate.studies.measured.specimen import Carried

PLACES = np.array([[0.2, 0.005, 0.016], [0.1, -0.006, 0.004], [0.15, 0.005, 0.01]])
"""Beyond the tip's upper edge, beside the bar, and on its top."""


def nodes(mesh, order):
    return mesh.nodes if order == 1 else np.vstack([mesh.nodes, mesh.nodes[mesh.edges].mean(axis=1)])


@pytest.mark.parametrize("order", [1, 2])
def test_a_rigid_motion_carries_them_along(bar, order):
    turn, shift = Rotation.from_euler("xyz", [0.3, -1.2, 2.0]).as_matrix(), np.array([0.1, -0.2, 0.3])
    rest = nodes(bar.coarse, order)
    carried = Carried(bar.coarse, PLACES, order)
    assert carried.of(rest) == pytest.approx(PLACES, abs=1e-15)
    assert carried.of(rest @ turn.T + shift) == pytest.approx(PLACES @ turn.T + shift, abs=1e-14)


def test_a_bent_surface_turns_them(bar):
    """On a bar bent to a circle a marker keeps its height, along the radius."""
    rest, radius = nodes(bar.coarse, 2), 0.3
    angle, height = rest[:, 0] / radius, rest[:, 2] - 0.005
    bent = np.column_stack([(radius - height) * np.sin(angle), rest[:, 1], radius - (radius - height) * np.cos(angle)])
    place = np.array([0.1, 0.005, 0.016])
    found = Carried(bar.coarse, place[None], 2).of(bent)[0]
    turned, above = 0.1 / radius, radius - (0.016 - 0.005)
    expected = [above * np.sin(turned), 0.005, radius - above * np.cos(turned)]
    assert found == pytest.approx(expected, abs=3e-5)
    along = found[0] - 0.1
    nearest = (radius - 0.005) * np.sin(turned) - 0.1
    assert along < nearest - 0.0015  # the displacement of the surface alone misses this
