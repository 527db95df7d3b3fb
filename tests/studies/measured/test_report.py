"""The part about a measured body follows from its table."""

import pytest
from fixtures.material import material, numbers, page

from palpate.studies.measured import report as measured


def text(table):
    return " ".join(page("measured", {"measured": table}).split())


def test_the_finding_is_about_what_was_not_fitted(measured_table):
    assert (
        "Beam: fitted to gravity alone, quadratic elements predict the place of load within 5 % (the measurement: "
        "± 8 %), the frequency of load within 4 % (the measurement: ± 4 %); they agree within the measurement; with "
        "the modulus before the creep, frequencies within 1 %."
    ) in text(measured_table)
    sharper = measured_table.assign(uncertainty=0.02)
    assert "; the measurement excludes the place of load; with" in text(sharper)
    assert "could be tested on." in text(measured_table[measured_table["calibrated"] == "no"])


def test_errors_are_compared(measured_table):
    (found,) = numbers("measured", {"measured": measured_table})["experiments"]
    (given,), (finest,) = found["given"], found["finest"]
    assert (given["of"], round(given["error"], 3)) == ("quadratic elements (P2), 1701 nodes", 0.01)
    assert (finest["case"], round(finest["error"], 3)) == ("load", -0.05)
    assert [row["how"] for row in found["stepped"]] == ["steps of 2 ms"] and found["laws"] == []
    assert [found["stepped"][0][name] for name in ("found", "wanted")] == pytest.approx([0.04717, 0.053])


def test_a_model_without_an_answer_has_failed(measured_table):
    assert list(measured.failures(material("measured", {"measured": measured_table}))) == []
    failed = list(measured.failures(material("measured", {"measured": measured_table.assign(message="stopped")})))
    assert failed[0] == ("quadratic elements (P2), 1701 nodes", "beam, gravity", "stopped")
