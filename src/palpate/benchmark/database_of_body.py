"""Put samples of a body that were made otherwise, or none, into a database."""

import numpy as np

from palpate.benchmark.database import Database
from palpate.bodies.body import Body


def database_of(body: Body, contacts: np.ndarray, forces: np.ndarray, coarse: np.ndarray, fine: np.ndarray) -> Database:
    """Return the samples of k ``contacts`` under ``forces`` (k, 3) [N], by responses (k, n, 3) [m] of both meshes."""
    surface = body.fine.surface
    return Database(
        nodes_fine_surface=body.fine.nodes[surface],
        triangles=np.searchsorted(surface, body.fine.triangles),
        coarse_nodes=body.coarse.nodes,
        coarse_tetrahedra=body.coarse.tetrahedra,
        coarse_surface=body.coarse.surface,
        prolongation=body.prolongation[surface].tocsr(),
        contact_normals=body.coarse.normals[body.coarse.surface],
        contact=contacts,
        force=forces,
        fine=fine[:, surface],
        coarse_paper=fine[:, : len(body.coarse.nodes)],
        coarse_live=coarse,
        residual=np.full(len(contacts), 1e-8),
        seconds=np.zeros(len(contacts)),
        material=body.material,
        config_digest="hard cases",
    )
