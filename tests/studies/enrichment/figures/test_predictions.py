"""The reader of bodies.h5."""

import h5py
import numpy as np
import pytest

from palpate.errors import InputError
from palpate.studies.enrichment.figures import bodies


def test_reads_the_methods_asked_for(predictions_file, database):
    found = bodies.read(predictions_file, "paper", "samples", ["detail_correction", "interpolation"])
    assert list(found) == ["detail_correction", "interpolation"]
    assert found["detail_correction"].predicted.shape == (5, len(database.nodes_fine_surface), 3)


def test_a_missing_file_or_group_is_named(predictions_file, tmp_path):
    with pytest.raises(InputError, match=r"nothing\.h5 is missing"):
        bodies.read(tmp_path / "nothing.h5", "paper", "samples", ["detail_correction"])
    with pytest.raises(InputError, match="live/contacts/detail_correction"):
        bodies.read(predictions_file, "live", "contacts", ["detail_correction"])


def test_a_wrong_shape_is_named(tmp_path):
    with h5py.File(tmp_path / "p.h5", "w") as file:
        file["live/contacts/detail_correction/sample"] = np.arange(3)
        file["live/contacts/detail_correction/predicted"] = np.zeros((2, 7, 3))
    with pytest.raises(InputError, match=r"live/contacts/detail_correction/predicted has shape \(2, 7, 3\)"):
        bodies.read(tmp_path / "p.h5", "live", "contacts", ["detail_correction"])
