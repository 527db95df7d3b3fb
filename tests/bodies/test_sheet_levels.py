"""Sheets are nested as solids are: coarse nodes first, linear fields reproduced, anchors passed on."""

import numpy as np
import pytest

from palpate.bodies.body import Body
from palpate.bodies.material import Material
from palpate.bodies.sheet_levels import nest_sheet, refine_sheet
from palpate.bodies.simple_shapes import sheet


@pytest.fixture
def cloth() -> Body:
    mesh = sheet([0.3, 0.2], [6, 4], 0.001)
    held = np.flatnonzero(np.linalg.norm(mesh.nodes[:, :2] - [0.15, 0.1], axis=1) < 0.06)
    return Body("cloth", [mesh], [], [held], Material(5e4, 0.3, 1000.0))


def test_a_finer_sheet_is_the_lattice_of_twice_the_divisions(cloth):
    fine, prolongation = refine_sheet(cloth.coarse)
    assert np.array_equal(fine.nodes[: len(cloth.coarse.nodes)], cloth.coarse.nodes)
    assert prolongation @ cloth.coarse.nodes == pytest.approx(fine.nodes)
    pair = fine, sheet([0.3, 0.2], [12, 8], 0.001)
    middles = [mesh.nodes[mesh.triangles].mean(axis=1).round(9) for mesh in pair]
    assert np.array_equal(*(np.sort(points.view("f8,f8,f8"), axis=0) for points in middles))
    a, b, c = (fine.nodes[fine.triangles[:, i]] for i in range(3))
    assert (np.cross(b - a, c - a)[:, 2] > 0.0).all()


def test_levels_begin_with_half_the_divisions_and_hold_what_the_sheet_holds(cloth):
    nested = nest_sheet(cloth, 2)
    assert [len(level.nodes) for level in nested.levels] == [12, 35, 117]
    pair = nested.levels[1].nodes[nested.anchors[1]], cloth.coarse.nodes[cloth.anchors[0]]
    assert np.array_equal(*(np.sort(points.round(9).view("f8,f8,f8"), axis=0) for points in pair))
    assert [len(held) for held in nested.anchors] == [2, 5, 13]
    alone = nest_sheet(cloth, 0)
    assert [len(level.nodes) for level in alone.levels] == [12] and not alone.prolongations


def test_a_sheet_of_odd_divisions_stays_as_it_is():
    mesh = sheet([0.3, 0.2], [5, 4], 0.001)
    odd = Body("cloth", [mesh], [], [np.array([0])], Material(5e4, 0.3, 1000.0))
    assert nest_sheet(odd, 1) is odd
