"""The sweep shows, for every σ, the error that the fitted method has on the body."""

import numpy as np
import pytest

from palpate.models.enrichment.features import FEATURES
from palpate.models.enrichment.paper_enrichment import Blend, DescribedSamples
from palpate.models.enrichment.training_samples import gather
from palpate.studies.enrichment.jobs import sweep_rows
from palpate.studies.enrichment.samples import sample_errors

TRAIN, TEST = np.arange(0, 20, 2), np.arange(1, 20, 2)
LABELS = {"body": "cylinder", "regime": "small"}


@pytest.fixture(scope="module")
def table(db, settings):
    return sweep_rows(db, TRAIN, TEST, "live", settings, LABELS)


def test_every_row_is_the_error_of_the_method_and_cross_validation_chooses_one(db, settings, table):
    training = gather(db.take(TRAIN), "live", settings)
    for name in FEATURES:
        known = DescribedSamples(training, name)
        for _, row in table[table["features"] == name].iterrows():
            method = Blend(known, row["weights"], row["sigma_m"])
            direct = sample_errors(db, method, "live", TEST)
            assert row["rmse_m"] == pytest.approx(direct["rmse_m"].mean(), rel=1e-6)
            assert row["rmse_of_peak"] == pytest.approx(direct["rmse_of_peak"].mean(), rel=1e-6)
        assert known.choose_sigma("signed") in table[table["features"] == name]["sigma_m"].to_numpy()
