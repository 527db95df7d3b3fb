"""A small database of known deformations: a cylinder that bends as a whole and is dented where pressed."""

import numpy as np
import pytest

from palpate.bodies.body import Body, Material, nest
from palpate.bodies.cylinder import cylinder
from palpate.enrichment.database import Database
from palpate.enrichment.training import Settings

LENGTH, RADIUS = 0.2, 0.03


@pytest.fixture(scope="session")
def body() -> Body:
    return nest("beam", cylinder(LENGTH, RADIUS), 1, np.arange(19), Material(3000.0, 0.3, 1000.0))


def deform(x: np.ndarray, contact: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Bending ~ z² plus a dent of 2 cm, both along the force; turning the body turns the answer."""
    bend = (x[:, 2:] / LENGTH) ** 2 * contact[2] / LENGTH
    dent = np.exp(-np.sum((x - contact) ** 2, axis=1, keepdims=True) / (2 * 0.02**2))
    return 0.01 * (bend + dent) * force * (1 + 0.2 * np.linalg.norm(force))


def make_database(body: Body, contacts: np.ndarray, forces: np.ndarray) -> Database:
    fine, coarse = body.fine, body.coarse
    where = coarse.nodes[contacts]
    whole = np.array([deform(fine.nodes, c, f) for c, f in zip(where, forces, strict=True)])
    on_coarse = whole[:, : len(coarse.nodes)]
    return Database(
        nodes_fine_surface=fine.nodes[fine.surface],
        triangles=np.searchsorted(fine.surface, fine.triangles),
        coarse_nodes=coarse.nodes,
        coarse_tetrahedra=coarse.tetrahedra,
        coarse_surface=coarse.surface,
        prolongation=body.prolongation[fine.surface].tocsr(),
        contact_normals=coarse.normals[coarse.surface],
        contact=contacts,
        force=forces,
        fine=whole[:, fine.surface],
        coarse_paper=on_coarse,
        coarse_live=0.9 * on_coarse,
        residual=np.full(len(contacts), 1e-9),
        material=body.material,
        config_digest="abc",
    )


@pytest.fixture(scope="session")
def db(body: Body) -> Database:
    """12 contacts, 2 magnitudes each, pressed along the inward normal."""
    random = np.random.default_rng(0)
    coarse = body.coarse
    side = coarse.surface[np.abs(coarse.normals[coarse.surface, 2]) < 0.5]
    contacts = np.repeat(random.choice(side, 12, replace=False), 2)
    forces = -np.tile([0.7, 1.3], 12)[:, None] * coarse.normals[contacts]
    return make_database(body, contacts, forces)


@pytest.fixture(scope="session")
def settings() -> Settings:
    return Settings(10, {"min": 0.01, "max": 100, "count": 9}, 5, "samples", 7)
