"""The work–precision diagram of enrichment names failures and frame budgets."""

import pytest
from fixtures.drawn import texts

from palpate.errors import InputError
from palpate.studies.enrichment.figures import bodies


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
