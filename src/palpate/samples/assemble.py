"""Make the database of a body from what was simulated on its fine and its coarse mesh."""

import hashlib
import json

import numpy as np
import pandas as pd

from palpate.bodies.body import Body
from palpate.samples.database import Database


def assemble(
    body: Body, loads: pd.DataFrame, fine: np.ndarray, coarse: np.ndarray, residual: np.ndarray, digest: str
) -> Database:
    """Put k samples of both protocols together.

    fine, coarse : (k, n_nodes of that level, 3) [m], responses to ``loads`` in the same order
    The ``paper`` protocol's coarse samples are the fine ones at the coarse nodes, which come first.
    """
    surface, mesh = body.fine.surface, body.coarse
    return Database(
        nodes_fine_surface=body.fine.nodes[surface],
        triangles=np.searchsorted(surface, body.fine.triangles),
        coarse_nodes=mesh.nodes,
        coarse_tetrahedra=mesh.tetrahedra,
        coarse_surface=mesh.surface,
        prolongation=body.prolongation[surface].tocsr(),
        contact_normals=mesh.normals[mesh.surface],
        contact=loads["contact"].to_numpy(),
        force=loads[["force_x_n", "force_y_n", "force_z_n"]].to_numpy(),
        fine=fine[:, surface],
        coarse_paper=fine[:, : len(mesh.nodes)],
        coarse_live=coarse,
        residual=residual,
        material=body.material,
        config_digest=digest,
    )


def digest(settings: dict) -> str:
    """A short name for ``settings`` that changes with any of them."""
    return hashlib.sha256(json.dumps(settings, sort_keys=True, default=str).encode()).hexdigest()[:16]
