"""Measure what the database of paper 1's regressor keeps in memory: arrays as they are, not formulas."""

import numpy as np
import pandas as pd

from palpate.benchmark.database import Database
from palpate.benchmark.model import FitOptions
from palpate.models.enrichment.features import Features, kinds
from palpate.models.enrichment.fitting import gather
from palpate.models.enrichment.paper_enrichment import Known, gaussian, inverse


def memory_rows(db: Database, train: np.ndarray, options: FitOptions) -> pd.DataFrame:
    """Tabulate for each kind of feature the memory [kB] of the feature vectors, of the fine displacements, of the
    matrix A, and of the orders of nodes around every coarse surface node, which any query may need.
    """
    training = gather(db, train, "paper", options)
    rows = []
    for name, features in kinds(db, options.neighbours).items():
        known = Known(features, training, options)
        matrix = inverse(gaussian(known.squared, known.scale))
        sizes = [known.described.nbytes, known.slots.nbytes, matrix.nbytes, _orders(features, db.coarse_surface)]
        rows.append([name, len(train), *(size / 1024 for size in sizes), sum(sizes) / 1024])
    return pd.DataFrame(rows, columns=COLUMNS)


COLUMNS = ["features", "train", "features_kb", "fine_kb", "matrix_kb", "orders_kb", "total_kb"]


def _orders(features: Features, contacts: np.ndarray) -> int:
    """Return the bytes of all views, each array counted once."""
    arrays = {
        id(array): array.nbytes
        for view in [features.view(int(contact)) for contact in contacts]
        for array in view
        if array is not None
    }
    return sum(arrays.values())
