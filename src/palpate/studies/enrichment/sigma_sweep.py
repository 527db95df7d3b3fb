"""Sweep σ as in the paper's figure 4: the error on the test samples for every σ, kind of feature and of weights.

The paper picks its σ from this table, that is on the test samples. The methods' own σ comes from cross-validation on
the training samples and stands in enrichment_accuracy.csv, so both can be compared.
"""

from collections.abc import Mapping

import numpy as np
import pandas as pd

from palpate.benchmark.database import Database
from palpate.benchmark.model import FitOptions
from palpate.models.enrichment.features import describe, in_slots, kinds
from palpate.models.enrichment.paper_enrichment import WEIGHTS, BlendWeights, DescribedSamples, squared_distances
from palpate.models.enrichment.training_samples import blend_errors, gather
from palpate.table_declaration import Table

SIGMA_SWEEP = Table(
    "sigma_sweep",
    "The test error of each blend at every width σ of its Gaussian kernel.",
    """
    body regime protocol split: a database, and what the coarse nodes come from and what is held out
    features weights: of the blend
    sigma_m sigma_relative: width [m], and over the features' distance
    rmse_m rmse_of_peak: mean error of the test samples [m], and over their peaks
    """,
)


def sweep_rows(
    db: Database, train: np.ndarray, test: np.ndarray, protocol: str, options: FitOptions, labels: Mapping[str, str]
) -> pd.DataFrame:
    """Tabulate sigma_sweep.csv; ``labels`` are body and regime; errors are means over the test samples."""
    training = gather(db, train, protocol, options)
    rows = []
    for features_name, features in kinds(db, options.neighbours).items():
        known = DescribedSamples(features, training, options)
        asked = describe(features, db.contact[test], db.coarse(protocol)[test])
        slots = in_slots(features, db.contact[test], db.fine[test])
        squared = squared_distances(known.described, asked)
        among, across, own = known.slots @ known.slots.T, known.slots @ slots.T, (slots**2).sum(axis=1)
        for kind in WEIGHTS:
            for sigma in known.sigmas:
                blends = BlendWeights(kind, known.squared, sigma)(squared)
                rmse = np.sqrt(blend_errors(blends, among, across, own) / db.fine.shape[1])
                which = [labels["body"], labels["regime"], protocol, options.split, features_name, kind]
                rows.append([*which, sigma, sigma / known.scale, rmse.mean(), (rmse / db.peaks[test]).mean()])
    return SIGMA_SWEEP.frame(rows)
