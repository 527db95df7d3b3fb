"""Report on paper 1: its tables and figures beside those of this run, and the comparisons that it leaves out."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from palpate.benchmark.ranking import front
from palpate.report import model_looks, tables
from palpate.report.report import Report
from palpate.report.words import capital, seconds, spaced
from palpate.studies.enrichment.premises import LOCAL
from palpate.table_declaration import Table

METHOD = "detail_correction"  # the method that is compared with those of the paper
PAPERS_WEIGHTS = model_looks.PAPERS.partition("_")[2]

MESH_SIZES = Table(
    "mesh_sizes",
    "The size of each body's meshes, level 0 being the coarse one, beside the counts that paper 1 publishes.",
    """
    body level: a body, and a level of its meshes
    surface_nodes surface_triangles nodes tetrahedra: of this level
    paper_nodes paper_triangles: of the paper's surface
    """,
)


def numbers(report: Report) -> dict[str, Any]:
    """Return what the template names beside its tables; errors are RMSE / peak."""
    by_name, paper = report.tables, report.published["enrichment"]
    accuracy = by_name["enrichment_accuracy"]
    regime = accuracy["regime"].iloc[0]
    moved = by_name["premise_bodies"]["moved_share"]
    contacts = tables.where(by_name["premises"], held_out="contacts", weights=PAPERS_WEIGHTS)
    return {
        "regime": regime,
        "method": METHOD,
        "paper_method": model_looks.PAPERS,
        "baseline": model_looks.BASELINE,
        "easy": _errors(accuracy, protocol="paper", split="samples", regime=regime),
        "hard": _errors(accuracy, protocol="live", split="contacts", regime=regime),
        "cases": [_case(rows) for _, rows in accuracy.groupby(["body", "regime"], sort=False)],
        "wins": _wins(accuracy, by_name["online_cost"]),
        "best_sigma": _best_sigma(tables.where(by_name["sigma_sweep"], regime=regime)),
        "splits": _splits(by_name["splits"], paper["splits"]),
        "moves": _moves(contacts, by_name["premise_bodies"]),
        "cut": (LOCAL, moved[moved <= LOCAL].max(), moved[moved > LOCAL].min()),  # and the shares next to it
        "fewer": _fewer(contacts),
        "orders": _orders(by_name["complexity"]),
        "means": by_name["enrichment_timing"].pivot(index="body", columns="method", values="mean_s"),
        "times": [
            _times(by_name["enrichment_timing"], body, paper) for body in tables.bodies(by_name["enrichment_timing"])
        ],
    }


def _errors(accuracy: pd.DataFrame, **case: str) -> pd.DataFrame:
    """Return the errors of one regime, protocol and split: a row a body, a column a method."""
    wide = tables.where(accuracy, **case).pivot(index="body", columns="method", values="rmse_of_peak")
    return wide.reindex(index=tables.bodies(accuracy))


def _best_sigma(sweep: pd.DataFrame) -> pd.Series:
    """Return the best σ [m] of the paper's method on the test samples, by body."""
    features, _, weights = model_looks.PAPERS.partition("_")
    curves = tables.where(sweep, protocol="paper", split="samples", features=features, weights=weights)
    best = curves.loc[curves.groupby("body", sort=False)["rmse_of_peak"].idxmin()]
    return best.set_index("body")["sigma_m"]


def _case(rows: pd.DataFrame) -> dict[str, Any]:
    """Return the errors of each method in one body and regime, in per cent, for each protocol and split."""
    body, regime = rows["body"].iloc[0], rows["regime"].iloc[0]
    rows = rows.assign(case=rows["protocol"] + ", " + rows["split"] + " held out", error=100 * rows["rmse_of_peak"])
    wide = rows.pivot(index="method", columns="case", values="error")
    wide = wide.reindex(index=rows["method"].unique(), columns=rows["case"].unique())
    cases = list(wide.columns)
    wide.insert(0, "method", [model_looks.look(m).label for m in wide.index])
    title = f"{capital(spaced(body))}, {spaced(regime)} loads"
    return {"key": f"{body}_{regime}", "title": title, "errors": wide, "best": cases}


def _wins(accuracy: pd.DataFrame, cost: pd.DataFrame) -> tuple[int, int, int]:
    """Count the comparisons in which METHOD is more accurate than every rival, or on the Pareto front, of how many."""
    most_accurate, on_front, count = 0, 0, 0
    joined = accuracy.merge(cost, on=["body", "protocol", "method"], how="left")
    for _, rows in joined.groupby(["body", "regime", "protocol", "split"], sort=False):
        rows = rows.reset_index(drop=True)
        count += 1
        rivals = ~rows["method"].str.startswith(METHOD)
        most_accurate += rows["rmse_of_peak"][rows["method"] == METHOD].min() < rows["rmse_of_peak"][rivals].min()
        on_front += METHOD in set(rows["method"][front(rows["online_median_s"], rows["rmse_of_peak"])])
    return int(most_accurate), on_front, count


def _splits(splits: pd.DataFrame, published: Mapping[str, Any]) -> pd.DataFrame:
    papers_counts = pd.DataFrame(published).T.rename(columns=lambda c: f"paper_{c}")
    frame = splits.merge(papers_counts, left_on="body", right_index=True, how="left")
    frame.loc[frame["split"] != "samples", papers_counts.columns] = np.nan
    return frame.rename(columns={"split": "held out"})


def _moves(rows: pd.DataFrame, bodies: pd.DataFrame) -> pd.DataFrame:
    """Return the errors of each premise with the most samples, a column for each kind of features, most local first."""
    rows = rows[rows["train"] == rows.groupby("premise")["train"].transform("max")]
    errors = rows.pivot(index="premise", columns="features", values="rmse_of_peak")
    shares = bodies.sort_values("moved_share", kind="stable").set_index("premise")["moved_share"]
    return errors.reindex(shares.index).assign(moved_share=shares)


def _fewer(rows: pd.DataFrame) -> pd.DataFrame:
    rows = rows[rows["features"].isin(["ordered", "framed"])]
    wide = rows.pivot(index=["premise", "train"], columns="features", values="ratio").reset_index()
    names = {"train": "training samples", "ordered": "ordered / unordered", "framed": "framed / unordered"}
    return wide.rename(columns=names)


def _orders(complexity: pd.DataFrame) -> pd.DataFrame:
    rows = []
    for row in complexity.to_dict("records"):
        operation, papers_order = model_looks.OPERATIONS.get(row["operation"], row["operation"]), row["paper_order"]
        exponents = (
            f"{row[f'exponent_{x}']:.2f} [{row[f'exponent_{x}_low']:.2f}, {row[f'exponent_{x}_high']:.2f}]"
            for x in "rk"
        )
        rows.append([operation, papers_order.replace("^2", "²"), *exponents])
    return pd.DataFrame(rows, columns=["operation", "the paper", "exponent of r", "exponent of k"])


def _times(timing: pd.DataFrame, body: str, paper: Mapping[str, Any]) -> dict[str, Any]:
    columns, papers_times = [*(f"d{i}_s" for i in range(1, 6)), "mean_s"], paper["timing"].get(body, {})
    rows: list[list[str]] = []
    papers_rows: list[int] = []
    for row in tables.where(timing, body=body).to_dict("records"):
        name = model_looks.short(row["method"]).replace("\n", " ")
        if row["method"] in papers_times:
            papers_rows.append(len(rows))
            times = papers_times[row["method"]]
            rows.append([name, "the paper", *map(seconds, [*times, np.mean(times)])])
        rows.append([name, "this run", *(seconds(row[column]) for column in columns)])
    frame = pd.DataFrame(rows, columns=["method", "source", *(f"load {i}" for i in range(1, 6)), "mean"])
    return {"body": spaced(body), "rows": frame, "faint": papers_rows, "number": paper["tables"].get(body)}
