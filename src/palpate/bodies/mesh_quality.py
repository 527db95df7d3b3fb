"""Tables of a body's meshes: the shapes of their elements and their counts."""

import warnings

import numpy as np
import pandas as pd

from palpate.bodies.body import Body
from palpate.bodies.mesh import EDGES, FACES, TetMesh
from palpate.errors import InputError

# dihedral angles [°] below which elements are reported, and below which a body is refused
LEAST_DEG, REFUSED_DEG = 10.0, 1.0


def quality(mesh: TetMesh) -> dict[str, float]:
    """Compute the extreme dihedral angles [°], smallest radius ratio (1 is a regular tetrahedron), volume [m³]."""
    angles = dihedral_angles(mesh)
    return {
        "min_dihedral_deg": float(angles.min()),
        "max_dihedral_deg": float(angles.max()),
        "min_radius_ratio": float(radius_ratios(mesh).min()),
        "volume_m3": float(mesh.volumes.sum()),
    }


def check_quality(body: Body, remedy: str) -> None:
    """Warn of elements with small dihedral angles on any level; InputError below 1°, where results mean nothing."""
    for level, mesh in enumerate(body.levels):
        if not isinstance(mesh, TetMesh):
            continue
        angles = dihedral_angles(mesh).min(axis=1)
        bad = int((angles < LEAST_DEG).sum())
        if not bad:
            continue
        sentence = (
            f"{bad} of {len(angles)} elements of level {level} have dihedral angles below {LEAST_DEG:g}° "
            f"(the smallest: {angles.min():.2g}°), which makes results there unreliable; {remedy}."
        )
        if angles.min() < REFUSED_DEG:
            raise InputError(sentence)
        warnings.warn(sentence, stacklevel=3)
        return


def dihedral_angles(mesh: TetMesh) -> np.ndarray:
    """Compute the angles inside each element along its six edges, (n_tetrahedra, 6) [°]."""
    corners = mesh.nodes[mesh.tetrahedra][:, FACES]
    normals = np.cross(corners[:, :, 1] - corners[:, :, 0], corners[:, :, 2] - corners[:, :, 0])
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    first, second = normals[:, EDGES[:, 0]], normals[:, EDGES[:, 1]]
    # atan2 keeps its accuracy where the arc cosine of nearly ±1 loses it
    sine = np.linalg.norm(np.cross(first, second), axis=2)
    return np.degrees(np.arctan2(sine, -(first * second).sum(axis=2)))


def radius_ratios(mesh: TetMesh) -> np.ndarray:
    """Compute three times inradius over circumradius, (n_tetrahedra,)."""
    corners = mesh.nodes[mesh.tetrahedra]
    faces = corners[:, FACES]
    areas = np.linalg.norm(np.cross(faces[:, :, 1] - faces[:, :, 0], faces[:, :, 2] - faces[:, :, 0]), axis=2) / 2
    inradius = 3 * np.abs(mesh.volumes) / areas.sum(axis=1)
    edges = corners[:, 1:] - corners[:, :1]
    centre = np.linalg.solve(2 * edges, (edges**2).sum(axis=2)[..., None])[..., 0]
    return 3 * inradius / np.linalg.norm(centre, axis=1)


def mesh_quality(body: Body) -> pd.DataFrame:
    """Tabulate each level: body, level, min_dihedral_deg, max_dihedral_deg, min_radius_ratio, volume_m3.

    A sheet, which has no tetrahedra, has no row.
    """
    meshes = [mesh for mesh in body.levels if isinstance(mesh, TetMesh)]
    rows = [{"body": body.name, "level": i, **quality(mesh)} for i, mesh in enumerate(meshes)]
    return pd.DataFrame(rows)


def mesh_sizes(body: Body, entry: dict) -> pd.DataFrame:
    """Tabulate each level's counts, beside those of the paper's mesh table where the paper gives them.

    ``entry["paper_surface"]``, optional, has (nodes, triangles) or None for each level.
    """
    papers = entry.get("paper_surface") or [None] * len(body.levels)
    rows = []
    for level, (mesh, paper) in enumerate(zip(body.levels, papers, strict=True)):
        paper_nodes, paper_triangles = paper or (pd.NA, pd.NA)
        rows.append(
            {
                "body": body.name,
                "level": level,
                "surface_nodes": len(mesh.surface),
                "surface_triangles": len(mesh.triangles),
                "nodes": len(mesh.nodes),
                "tetrahedra": len(mesh.tetrahedra),
                "paper_nodes": paper_nodes,
                "paper_triangles": paper_triangles,
            }
        )
    return pd.DataFrame(rows).astype({"paper_nodes": "Int64", "paper_triangles": "Int64"})
