"""The snapshot of a run says what its tables say, and cites a commit that exists."""

import subprocess

import pandas as pd
import pytest
from fixtures.trade_off import OWN

from palpate.errors import InputError
from palpate.report import results_markdown
from palpate.report.model_looks import label


@pytest.fixture
def results(trade_off_tables, dynamic_table, tmp_path):
    hard = {"family": ["fem", "fem", "enrichment"], "outcome": ["stable", "refused", "stable"]}
    rows = [
        {"component": "fem", "stage": "respond", "size": size, "seconds": 1e-5 * size, "memory_mb": 1e-3 * size}
        for size in (5000, 40_000)
    ]
    effects = [["corotational", 8.0, None], ["held", 0.0, 9.0], ["gravity", 0.5, 0.3], ["integrator", 3.5, None]]
    tables = {
        "accuracy_vs_time": trade_off_tables["accuracy_vs_time"],
        "truth": trade_off_tables["truth"],
        "dynamic_accuracy": dynamic_table,
        "effects": pd.DataFrame(effects, columns=["effect", "ms_per_step", "error_if_left_out"]).assign(
            scene="sag", share_of_step=0.0, memory_kb=0.0
        ),
        "advice": trade_off_tables["advice"],
        "advice_agreement": trade_off_tables["advice_agreement"],
        "advice_by_radius": trade_off_tables["advice_by_radius"],
        "hard_cases": pd.DataFrame(hard).assign(
            case="c",
            source="",
            scene="",
            model="m",
            measure="",
            value=1,
            bound=1,
            declared="",
            passed=True,
            message="",
            frozen=2.0,
            zero=2.0,
            tenth=2.0,
            sharp=True,
        ),
        "scaling": pd.DataFrame(rows).assign(unit="", threads=1, seconds_exponent=1.0, memory_exponent=1.0),
    }
    for folder in ("tables", "figures"):
        (tmp_path / folder).mkdir()
    for name, table in tables.items():
        table.to_csv(tmp_path / "tables" / f"{name}.csv", index=False)
    for name in [*(f"work_precision_{scene}" for scene in OWN), *results_markdown.PICTURES]:
        (tmp_path / "figures" / f"{name}.png").write_bytes(name.encode())
    return tmp_path


def test_advice_outcomes_and_sizes_are_told(results, tmp_path):
    docs = tmp_path / "docs"
    docs.mkdir()
    results_markdown.write(results, docs)
    page = (docs / "results.md").read_text(encoding="utf-8").replace("\u00a0", " ")
    assert "| liver_small | rms | within 0.0001 ms | none |" in page
    advised = label("detail_correction", "coarse=2 iterations, samples=42")
    assert f"| liver_small | rms | within 16.7 ms | {advised} | 0.6 % (" in page

    assert f"| liver_small | patch | within 16.7 ms | {advised} | 3 % (" in page
    assert "| family | refused | stable |\n| --- | --- | --- |\n| enrichment | 0 | 1 |\n| fem | 1 | 1 |" in page
    assert "| 40000 | 400 ms | 0.04 GB |" in page
    assert "| sag | corotational | 12 ms | gravity 30 % |" in page
    assert "| liver_press | 1 %, 0.025 × | 4 %, 5 × |" in page
    assert "| liver_small | 15 | 0.09 % | 0.3 % | 0.22 % | 1.6 | 0 | 321,536 |" in page
    coarse, stored = label("detail_correction", "default"), label("linear_residual", "default")
    assert f"| liver_small | rms | {stored} 4 of 5 | {coarse} 5 of 5 |" in page
    linear = label("linear_fem", "default")
    assert f"| liver | patch | 12 mm | → {linear} 2.5 % | {coarse} 2.5 % | {stored} 2.5 % | none |" in page
    assert f"| liver | patch | 8 mm | {stored} 3.8 % |" in page
    for line in (line for line in page.splitlines() if line.startswith("![")):
        assert (docs / line.split("(")[1].rstrip(")")).is_file()


def test_studies_of_tissue_are_told_where_they_ran(results, law_table, measured_table, tmp_path):
    docs = tmp_path / "docs"
    docs.mkdir()
    columns = ["body", "contact", "cover_m", "force_n", "depth_m", "depth_without_m", "stiffer", "felt", "threshold"]
    pressed = [["lump", 3, 0.004, force, 1e-3, 2e-3, stiffer, True, 0.15] for force, stiffer in ((1, 0.2), (2, 0.3))]
    palpation = pd.DataFrame(pressed, columns=columns)
    found = {"law": law_table, "measured": measured_table, "palpation": palpation}
    for name, table in found.items():
        table.to_csv(results / "tables" / f"{name}.csv", index=False)
        picture = "measured_beam" if name == "measured" else name
        (results / "figures" / f"{picture}.png").write_bytes(name.encode())
    results_markdown.write(results, docs)
    page = (docs / "results.md").read_text(encoding="utf-8").replace("\u00a0", " ")
    assert "| liver | St. Venant–Kirchhoff | 10 % | 3 % | 4.5 % | 5 % | 7.5 % | 0.1 % |" in page
    assert "| beam | load | quadratic elements (P2), 1701 nodes | -5.0 % | -4.0 % | 2 %, 1 % |" in page
    assert "| lump | 4 mm | 30 % | yes |" in page and "20 %" not in page.partition("## Palpation")[2][:500]
    for name in ("law", "measured_beam", "palpation"):
        assert f"(results/{name}.png)" in page and (docs / f"results/{name}.png").is_file()


def test_a_missing_picture_is_named(results, tmp_path):
    (results / "figures/scaling.png").unlink()
    with pytest.raises(InputError, match=r"scaling\.png is missing"):
        results_markdown.write(results, tmp_path)
    assert not (tmp_path / "results.md").exists()


def test_a_commit_that_the_repository_lacks_is_refused(results, tmp_path):
    docs = tmp_path / "docs"
    docs.mkdir()
    subprocess.run(["git", "init", "-q", str(docs)], check=True)
    with pytest.raises(InputError, match="made up, which this repository does not have"):
        results_markdown.write(results, docs)
    assert not (docs / "results.md").exists()


def test_what_to_take_says_how_many_splits_agree(results, tmp_path):
    advice = pd.read_csv(results / "tables/advice.csv")
    assert "splits" not in results_markdown.results_tables.advice(advice)
    other = advice.assign(split=2, model=advice["model"].where(advice["error"] == "rms", "linear_fem"))
    table = results_markdown.results_tables.advice(pd.concat([advice, other]))
    taken = table[table["take"] != "none"].reset_index(drop=True)
    assert set(taken.loc[taken["error of"] == "rms", "splits"]) == {"2 of 2"}
    assert "1 of 2" in set(taken.loc[taken["error of"] == "patch", "splits"])
