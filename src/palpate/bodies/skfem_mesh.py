"""Take a mesh of scikit-fem for the coarse mesh of a body, as far as one of a file is taken."""

from typing import Any

import numpy as np

from palpate.bodies.mesh import TetMesh
from palpate.bodies.mesh_file import guess_scale, in_words
from palpate.bodies.mesh_quality import check_boundary, check_coordinates, check_tetrahedra
from palpate.bodies.seams import check_seams
from palpate.bodies.settings import POSSIBLE_M
from palpate.errors import InputError


def read_skfem(source: str, mesh: Any) -> TetMesh:
    """Return the tetrahedra of a ``MeshTet`` in metres, with their nodes in its order; InputError naming ``source``."""
    from skfem import ElementTetP1

    if getattr(mesh, "elem", None) is not ElementTetP1:
        kind = type(mesh).__name__
        raise InputError(
            f"{source}: a {kind} has no tetrahedra with 4 nodes alone; give a MeshTet, such as of its p, t."
        )
    nodes, corners = np.ascontiguousarray(mesh.p.T, dtype=float), np.ascontiguousarray(mesh.t.T, dtype=np.int64)
    check_coordinates(source, nodes)
    if len(unused := np.setdiff1d(np.arange(len(nodes)), corners)):
        raise InputError(
            f"{source}: {len(unused)} of {len(nodes)} nodes are of no tetrahedron (first: node {unused[0]}); give the "
            "mesh without them, such as mesh.remove_unused_nodes()."
        )
    size = float(np.ptp(nodes, axis=0).max())
    if not POSSIBLE_M[0] <= size <= POSSIBLE_M[1]:
        unit, scale = guess_scale(size) or ("millimetre", 1e-3)
        raise InputError(
            f"{source}: its longest side is {in_words(size)}, and bodies are {POSSIBLE_M[0]:g} to {POSSIBLE_M[1]:g} m "
            f"long here; give it in metres, as mesh.scaled({scale:g}) if its unit is the {unit}."
        )
    inverted = TetMesh(nodes, corners).volumes < 0.0
    corners[inverted] = corners[inverted][:, [0, 1, 3, 2]]  # scikit-fem sorts the nodes of its elements
    coarse = TetMesh(nodes, check_tetrahedra(source, nodes, corners))
    check_boundary(source, coarse)
    check_seams(source, coarse)
    return coarse
