"""The reader of predictions.h5."""

import h5py
import numpy as np
import pytest

from palpate.errors import InputError
from palpate.figures.enrichment import predictions


def test_reads_the_methods_asked_for(predictions_file, database):
    found = predictions.read(predictions_file, "paper", "samples", ["ours", "interpolation"])
    assert list(found) == ["ours", "interpolation"]
    assert found["ours"].predicted.shape == (5, len(database.nodes_fine_surface), 3)


def test_a_missing_file_or_group_is_named(predictions_file, tmp_path):
    with pytest.raises(InputError, match=r"nothing\.h5 is missing"):
        predictions.read(tmp_path / "nothing.h5", "paper", "samples", ["ours"])
    with pytest.raises(InputError, match="live/contacts/ours"):
        predictions.read(predictions_file, "live", "contacts", ["ours"])


def test_a_wrong_shape_is_named(tmp_path):
    with h5py.File(tmp_path / "p.h5", "w") as file:
        file["live/contacts/ours/sample"] = np.arange(3)
        file["live/contacts/ours/predicted"] = np.zeros((2, 7, 3))
    with pytest.raises(InputError, match=r"live/contacts/ours/predicted has shape \(2, 7, 3\)"):
        predictions.read(tmp_path / "p.h5", "live", "contacts", ["ours"])
