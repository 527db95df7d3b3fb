"""Nested levels of a sheet, as solids have them: coarse nodes first, and anchors passed on."""

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from palpate.bodies.body import Body
from palpate.bodies.mesh import Sheet
from palpate.bodies.refinement import halfway, midpoints_between
from palpate.bodies.simple_shapes import sheet


def nest_sheet(body: Body, count: int) -> Body:
    """Return a sheet with levels: one of half its divisions, refined ``count`` times, so that level 1 is the given one.

    A sheet with an odd number of divisions is returned as it is.
    """
    given = body.coarse
    assert isinstance(given, Sheet)
    divisions = _divisions(given)
    if any(number % 2 for number in divisions):
        return body
    coarsest = sheet(list(np.ptp(given.nodes, axis=0)[:2]), [number // 2 for number in divisions], given.thickness_m)
    nearest_given = cKDTree(given.nodes).query(coarsest.nodes)[1]
    levels, prolongations, anchors = [coarsest], [], [np.flatnonzero(np.isin(nearest_given, body.anchors[0]))]
    for number in range(count):
        finer, prolongation = refine_sheet(levels[-1])
        if number:
            held = midpoints_between(anchors[-1], prolongation)
        else:
            held = np.flatnonzero(np.isin(cKDTree(given.nodes).query(finer.nodes)[1], body.anchors[0]))
        levels.append(finer)
        prolongations.append(prolongation)
        anchors.append(held)
    return Body(body.name, levels, prolongations, anchors, body.material)


def refine_sheet(coarse: Sheet) -> tuple[Sheet, sparse.csr_array]:
    """Split the cells of a sheet; return the finer one, whose first nodes are the coarse ones, and the prolongation.

    A finer lattice has its nodes where the coarse one has nodes and middles of edges, diagonals included.
    """
    edges = coarse.edges
    nodes = np.vstack([coarse.nodes, coarse.nodes[edges].mean(axis=1)])
    divisions = [2 * number for number in _divisions(coarse)]
    lattice = sheet(list(np.ptp(coarse.nodes, axis=0)[:2]), divisions, coarse.thickness_m)
    triangles = cKDTree(nodes).query(lattice.nodes)[1][lattice.triangles]
    return Sheet(nodes, np.ascontiguousarray(triangles), coarse.thickness_m), halfway(len(coarse.nodes), edges)


def _divisions(lattice: Sheet) -> list[int]:
    return [len(np.unique(lattice.nodes[:, axis].round(9))) - 1 for axis in range(2)]
