"""A case and its test samples, read from what the workflow has simulated."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from palpate.bodies.body_file import load
from palpate.enrichment.training_samples import FitOptions
from palpate.models.model import Case, rows_of
from palpate.samples.database import Database, read
from palpate.samples.press import load_responses
from palpate.samples.split import sides
from palpate.solvers.compliance import load_compliance


def read_case(
    body: Path,
    database: Path,
    compliance: Path | None,
    split: Path,
    fine: Sequence[Path],
    coarse: Path,
    regime: str,
    radius_m: float,
    options: FitOptions,
    tolerance: float,
) -> tuple[Case, Database, np.ndarray]:
    """A case with the training samples of ``options.split``, the test samples, and the numbers of those.

    fine, coarse : the responses, for the time that each sample took on both meshes
    """
    db = read(database)
    train, test = sides(pd.read_csv(split)[options.split])
    took = load_responses(fine).seconds + load_responses([coarse]).seconds
    linear = load_compliance(compliance) if compliance else None
    case = Case(load(body), regime, radius_m, rows_of(db, train), linear, options, tolerance, took[train])
    return case, rows_of(db, test), test
