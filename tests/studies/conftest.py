"""A database of random numbers: enough for tables, whose meaning does not depend on physics."""

import numpy as np
import pytest
from fixtures.cut_tables import *  # noqa: F403
from fixtures.results import *  # noqa: F403
from fixtures.studies import *  # noqa: F403
from fixtures.touch_tables import *  # noqa: F403
from fixtures.trade_off import *  # noqa: F403
from scipy.sparse import csr_array

from palpate.benchmark.database import Database
from palpate.benchmark.settings import FitOptions, Widths
from palpate.bodies.material import Material


@pytest.fixture(scope="session")
def db() -> Database:
    """20 samples, 30 coarse nodes (20 of them on the surface), 50 fine surface nodes."""
    random = np.random.default_rng(0)
    amounts = random.normal(size=(20, 3))
    coarse = np.tensordot(amounts, random.normal(size=(3, 30, 3)), 1)
    normals = random.normal(size=(20, 3))
    return Database(
        nodes_fine_surface=random.normal(size=(50, 3)),
        triangles=random.integers(0, 50, (96, 3)),
        coarse_nodes=random.normal(size=(30, 3)),
        coarse_tetrahedra=random.integers(0, 30, (60, 4)),
        coarse_surface=np.arange(20),
        prolongation=csr_array(random.random((50, 30)) / 15),
        contact_normals=normals / np.linalg.norm(normals, axis=1, keepdims=True),
        contact=np.repeat(np.arange(10), 2),
        force=amounts,
        fine=np.tensordot(amounts, random.normal(size=(3, 50, 3)), 1),
        coarse_paper=coarse,
        coarse_live=coarse + 0.1 * random.normal(size=coarse.shape),
        residual=np.zeros(20),
        seconds=np.ones(20),
        material=Material(3000.0, 0.3, 1000.0),
        config_digest="abc",
    )


@pytest.fixture(scope="session")
def settings() -> FitOptions:
    return FitOptions(neighbours=5, sigma_relative=Widths(min=0.1, max=10, count=4), folds=3, split="samples", seed=1)
