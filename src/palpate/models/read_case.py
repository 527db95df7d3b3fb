"""Read a case and its test samples from what the workflow has simulated."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from palpate.bodies.body_file import load
from palpate.enrichment.training_samples import FitOptions
from palpate.models.model import Case
from palpate.samples.database import Database, read
from palpate.samples.sample_table import read_samples, sides
from palpate.solvers.compliance import load_compliance


def read_case(
    body: Path,
    database: Path,
    compliance: Path | None,
    samples: Path,
    regime: str,
    radius_m: float,
    options: FitOptions,
    tolerance: float,
    grid: Mapping[str, Mapping[str, Any]],
) -> tuple[Case, Database, np.ndarray]:
    """Return a case with the training samples of ``options.split``, the test samples, and the numbers of those.

    samples : the table of ``samples.sample_table``; the others as in ``Case``
    """
    db = read(database)
    train, test = sides(read_samples(samples), options.split)
    linear = load_compliance(compliance) if compliance else None
    case = Case(load(body), regime, radius_m, db.take(train), linear, options, tolerance, grid)
    return case, db.take(test), test
