"""Sentences about a measured body follow from their table."""

import pandas as pd
from fixtures.material import material, numbers

from palpate.report import page as report
from palpate.studies.measured import report as measured


def test_the_headline_is_about_what_was_not_fitted(measured_table):
    assert numbers("measured", {"measured": measured_table})["headline"] == (
        "Beam: fitted to gravity alone, quadratic elements predict the place of load within 5 % "
        "and the frequency of load within 4 %; with the modulus before the creep, frequencies within 1 %."
    )
    given = measured_table[measured_table["calibrated"] == "no"]
    assert numbers("measured", {"measured": given})["headline"].endswith("could be tested on.")


def test_the_answer_compares_steps_with_what_was_measured(measured_table):
    found = measured.answer(measured_table)
    assert found["given"] == "1\u00a0% more (quadratic elements (P2), 1701 nodes)"
    assert found["stepped"] == "0.047 for 0.053 (gravity, steps of 2 ms)"
    assert found["alike"] == "other laws were not tried"
    assert found["predicted"] == "5\u00a0% less in load (quadratic elements (P2))"


def test_what_laws_share_is_told(measured_table):
    more = measured_table[measured_table["calibrated"].eq("gravity") & measured_table["setting"].eq("level=0")]
    more = more.assign(setting="level=0 law=neo_hookean", law="neo_hookean", error=more["error"] - 0.001)
    found = measured.answer(pd.concat([measured_table, more]))["alike"].replace("\u00a0", " ")
    assert found == (
        "quadratic elements of one mesh under 2 laws and 1 Poisson's ratios from 5.1 % less to 5 % less in load"
    )


def test_the_headline_has_the_coarser_mesh_too(measured_table):
    finer = measured_table[measured_table["setting"].eq("level=0")].assign(setting="level=1", nodes=11849)
    said = numbers("measured", {"measured": pd.concat([measured_table, finer.assign(error=finer["error"] * 1.1)])})
    assert "the place of load within 5.5 % (5 % on 1701 nodes) and the frequency" in said["headline"].replace(
        "\u00a0", " "
    )


def test_a_model_without_an_answer_has_failed(measured_table):
    assert list(measured.failures(material("measured", {"measured": measured_table}))) == []
    silent = measured_table.assign(message="stopped")
    failed = list(measured.failures(material("measured", {"measured": silent})))
    assert failed[0] == ("quadratic elements (P2), 1701 nodes", "beam, gravity", "stopped")


def test_the_report_shows_it(measured_table, tmp_path):
    (tmp_path / "tables").mkdir()
    (tmp_path / "figures").mkdir()
    measured_table.to_csv(tmp_path / "tables/measured.csv", index=False)
    for suffix in ("svg", "png"):
        (tmp_path / f"figures/measured_beam.{suffix}").write_text("<svg></svg>")
    report.write(tmp_path, tmp_path / "report.html", ["measured"])
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert '<figure id="figure_measured_beam">' in page and "Predictions of cases without files" in page
