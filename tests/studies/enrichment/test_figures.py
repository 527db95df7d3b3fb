"""The work–precision diagram of enrichment names failures and frame budgets."""

import numpy as np
import pytest
from fixtures.drawn import texts

from palpate.errors import InputError
from palpate.report import style
from palpate.studies.enrichment.figures import bodies


@pytest.mark.slow
def test_deformed_bodies_shows_different_contacts_and_true_errors(body, database, predictions_file, tmp_path):
    found = bodies.read(predictions_file, "paper", "samples", bodies.DEFORMED_BY)
    figure = bodies.draw_deformed_bodies(body, database, found)
    pictures = [axis for axis in figure.axes if axis.images]
    assert len(pictures) == bodies.SAMPLES * 6
    shown = [int(t.split(":")[0].split()[1]) for t in texts(figure) if t.startswith("sample")]
    assert len(set(database.contact[shown])) == bodies.SAMPLES
    assert (np.diff(database.peaks[shown]) >= 0).all()
    i = shown[0]
    rms = np.sqrt(np.mean(np.sum(database.fine[i] ** 2, axis=1)))
    wrong = 100 * 0.3 * (1 + i / 10) * rms / database.peaks[i]
    assert f"error {wrong:.2g} % of peak" in texts(figure)
    style.save(figure, tmp_path / "deformed")


def test_error_over_body_ranks_each_method(body, database, predictions_file):
    found = bodies.read(predictions_file, "paper", "samples", bodies.JUDGED)
    figure = bodies.draw_error_over_body(body, database, {"paper protocol, samples held out": found})
    samples = [int(t.split(":")[0].split()[1]) for t in texts(figure) if t.startswith("sample")]
    assert samples == [0, 4, 7] * 3  # conftest: the later the sample the worse


def test_a_missing_file_or_group_is_named(predictions_file, tmp_path):
    with pytest.raises(InputError, match=r"nothing\.h5 is missing"):
        bodies.read(tmp_path / "nothing.h5", "paper", "samples", ["detail_correction"])
    with pytest.raises(InputError, match=r"predictions\.h5 is damaged"):
        bodies.read(predictions_file, "live", "contacts", ["detail_correction"])
