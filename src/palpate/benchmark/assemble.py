"""Assemble the database of a body from what was simulated on its fine and its coarse mesh."""

import hashlib
import json

import numpy as np
import pandas as pd

from palpate.benchmark.database import Database
from palpate.benchmark.static_responses import Responses
from palpate.bodies.body import Body
from palpate.errors import InputError


def assemble(
    body: Body,
    loads: pd.DataFrame,
    fine: Responses,
    paper: tuple[np.ndarray, np.ndarray],
    live: Responses,
    digest: str,
) -> Database:
    """Put the k samples of both protocols together.

    fine, live : responses of the fine and of the coarse mesh to ``loads``, in the same order
    paper : sample numbers (k,) and coarse displacements (k, N, 3) [m] that were subsampled from the fine ones
    Raises InputError where they are not of the same samples.
    """
    for name, sample in (("fine", fine.sample), ("subsampled", paper[0]), ("coarse", live.sample)):
        if not np.array_equal(sample, loads["sample"]):
            raise InputError(f"{body.name}: the {name} responses are not those to the loads; simulate them again.")
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
        fine=fine.displacement[:, surface],
        coarse_paper=paper[1],
        coarse_live=live.displacement,
        residual=fine.residual,
        seconds=fine.seconds + live.seconds,
        material=body.material,
        config_digest=digest,
    )


def digest(settings: dict) -> str:
    """Name ``settings`` briefly; the name changes with any of them."""
    return hashlib.sha256(json.dumps(settings, sort_keys=True, default=str).encode()).hexdigest()[:16]
