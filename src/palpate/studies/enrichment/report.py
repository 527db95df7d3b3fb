"""Report on paper 1: its tables and figures beside those of this run, and the comparisons that it leaves out."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd

from palpate.benchmark.ranking import front
from palpate.report import style, tables
from palpate.report.report import Report
from palpate.report.words import capital, seconds, spaced
from palpate.studies.enrichment.premises import LOCAL
from palpate.table_declaration import Table

TITLE = "Paper 1: enriching a coarse simulation"
METHOD = "detail_correction"  # the method that is compared with those of the paper
PAPERS_WEIGHTS = style.PAPERS.partition("_")[2]

ENRICHMENT_ACCURACY = Table(
    "enrichment_accuracy",
    "The test errors of each method in every body, regime, protocol and split; blends at their best width σ.",
    """
    body regime protocol split method: a database, what coarse nodes come from and what is held out, and a method
    sigma_m samples: width of its kernel [m], and number of test samples
    rmse_m rmse_of_peak: mean error [m], and over the peaks
    p95_of_peak max_of_peak: 95th percentile and largest error / peak
    """,
)

MESH_SIZES = Table(
    "mesh_sizes",
    "The size of each body's meshes, level 0 being the coarse one, beside the counts that paper 1 publishes.",
    """
    body level: a body, and a level of its meshes
    surface_nodes surface_triangles nodes tetrahedra: of this level
    paper_nodes paper_triangles: of the paper's surface
    """,
)

SPLITS = Table(
    "splits",
    "How many samples of each body and regime the methods learn from, and how many they are tested on.",
    """
    body regime split train test: a database, what is held out, and numbers of samples
    """,
)

SAMPLE_PEAKS = Table(
    "sample_peaks",
    "The largest displacement of the surface in each sample.",
    """
    body regime sample peak_m: a sample, and its largest displacement [m]
    """,
)

FEM_COST = Table(
    "fem_cost",
    "The work, the time and the last residual of each finite-element simulation on the fine mesh.",
    """
    body regime sample: a sample
    newton_iterations linear_solves residual seconds: iterations, solves, last relative residual, and time [s]
    """,
)


def numbers(report: Report) -> dict[str, Any]:
    """Return what the template names; errors are RMSE / peak."""
    found, paper = report.tables, report.published["enrichment"]
    accuracy = found["enrichment_accuracy"]
    regime = accuracy["regime"].iloc[0]
    easy = tables.where(accuracy, protocol="paper", split="samples", regime=regime)
    hard = tables.where(accuracy, protocol="live", split="contacts", regime=regime)
    cases = dict.fromkeys(zip(accuracy["body"], accuracy["regime"], strict=True))
    moved = found["premise_bodies"]["moved_share"]
    return {
        "regime": regime,
        "bodies": [_of_body(body, easy, hard, report) for body in tables.bodies(accuracy)],
        "cases": [_case(accuracy, body, regime) for body, regime in cases],
        "method": style.short(METHOD).replace("\n", " "),
        "wins": _wins(accuracy, found["online_cost"]),
        "meshes": _equal_meshes(found["mesh_sizes"]),
        "splits": _splits(found["splits"], paper["splits"]),
        "lengths": {
            style.FEATURES[str(name)][0]: 3 * (node + 1)
            for name, node in found["feature_vectors"].groupby("features", sort=False)["node"].max().items()
        },
        "premises": _premises(found["premises"], found["premise_bodies"]),
        "cut": (LOCAL, moved[moved <= LOCAL].max(), moved[moved > LOCAL].min()),  # and the nearest on both sides
        "fewer": _fewer(found["premises"]),
        "orders": _orders(found["complexity"]),
        "times": [
            _times(found["enrichment_timing"], body, paper) for body in tables.bodies(found["enrichment_timing"])
        ],
        "fem": [
            {"body": body, "regime": one, "median": part.median(), "most": part.max()}
            for (body, one), part in found["fem_cost"].groupby(["body", "regime"], sort=False)["seconds"]
        ],
    }


def _of_body(body: str, easy: pd.DataFrame, hard: pd.DataFrame, report: Report) -> dict[str, Any]:
    """Return errors of the compared methods on one body: in the paper's protocol, and live at new contacts."""
    cost, timing = report.tables["online_cost"], report.tables["enrichment_timing"]
    kinds = {"own": METHOD, "linear": "interpolation", "ordered": style.PAPERS, "unordered": style.BASELINE}
    errors = [tables.where(table, body=body).set_index("method")["rmse_of_peak"] for table in (easy, hard)]
    here = tables.where(timing, body=body).set_index("method")["mean_s"]
    return {
        "name": body,
        "easy": {kind: errors[0][method] for kind, method in kinds.items()},
        "hard": {kind: errors[1][method] for kind, method in kinds.items() if kind != "unordered"},
        "seconds": tables.where(cost, body=body, protocol="live", method=METHOD)["online_median_s"].iloc[0],
        "faster": _speedups(here),
        "faster_there": _speedups(report.published["enrichment"]["means"].get(body)),
        **_sigma(tables.where(report.tables["sigma_sweep"], body=body, regime=easy["regime"].iloc[0]), report),
    }


def _speedups(mean: Mapping[str, float] | pd.Series | None) -> tuple[float, float] | None:
    """Return how much faster contact-ordered is than unordered, and than fine FEM."""
    if mean is None:
        return None
    return mean["unordered"] / mean["contact_ordered"], mean["fine_fem"] / mean["contact_ordered"]


def _sigma(sweep: pd.DataFrame, report: Report) -> dict[str, Any]:
    """Return the best σ of the paper's method on the test samples, and in mesh units where these are known."""
    features, _, weights = style.PAPERS.partition("_")
    curve = tables.where(sweep, protocol="paper", split="samples", features=features, weights=weights)
    best = curve.loc[curve["rmse_of_peak"].idxmin()]
    unit_m = report.published["enrichment"]["sigma"]["unit_m"].get(best["body"])
    return {"sigma_mm": 1e3 * best["sigma_m"], "sigma_units": None if unit_m is None else best["sigma_m"] / unit_m}


def _case(accuracy: pd.DataFrame, body: str, regime: str) -> dict[str, Any]:
    rows = tables.where(accuracy, body=body, regime=regime)
    rows = rows.assign(case=rows["protocol"] + ", " + rows["split"] + " held out", error=100 * rows["rmse_of_peak"])
    wide = rows.pivot(index="method", columns="case", values="error")
    wide = wide.reindex(index=rows["method"].unique(), columns=rows["case"].unique())
    cases = list(wide.columns)
    wide.insert(0, "method", [style.look(m).label for m in wide.index])
    title = f"{capital(spaced(body))}, {spaced(regime)} loads"
    return {"key": f"{body}_{regime}", "title": title, "errors": wide, "best": cases}


def _wins(accuracy: pd.DataFrame, cost: pd.DataFrame) -> tuple[int, int, int]:
    """Count the comparisons in which METHOD is more accurate than every rival, or on the Pareto front, of how many."""
    best, on_front, count = 0, 0, 0
    joined = accuracy.merge(cost, on=["body", "protocol", "method"], how="left")
    for _, rows in joined.groupby(["body", "regime", "protocol", "split"], sort=False):
        rows = rows.reset_index(drop=True)
        count += 1
        rivals = ~rows["method"].str.startswith(METHOD)
        best += rows["rmse_of_peak"][rows["method"] == METHOD].min() < rows["rmse_of_peak"][rivals].min()
        on_front += METHOD in set(rows["method"][front(rows["online_median_s"], rows["rmse_of_peak"])])
    return int(best), on_front, count


def _equal_meshes(sizes: pd.DataFrame) -> tuple[int, int]:
    """Count the surfaces that have the paper's numbers of nodes and triangles, and those that it has."""
    rows = sizes.dropna(subset=["paper_nodes"])
    equal = (rows["surface_nodes"] == rows["paper_nodes"]) & (rows["surface_triangles"] == rows["paper_triangles"])
    return int(equal.sum()), len(rows)


def _splits(splits: pd.DataFrame, published: Mapping[str, Any]) -> pd.DataFrame:
    theirs = pd.DataFrame(published).T.rename(columns=lambda c: f"paper_{c}")
    frame = splits.merge(theirs, left_on="body", right_index=True, how="left")
    frame.loc[frame["split"] != "samples", theirs.columns] = np.nan
    return frame.rename(columns={"split": "held out"})


def _premises(premises: pd.DataFrame, about: pd.DataFrame) -> list[dict[str, Any]]:
    rows = tables.where(premises, held_out="contacts", weights=PAPERS_WEIGHTS)
    rows = rows[rows["train"] == rows.groupby("premise")["train"].transform("max")]
    found = []
    for row in about.sort_values("moved_share", kind="stable").itertuples():
        errors = tables.where(rows, premise=row.premise).set_index("features")["rmse_of_peak"]
        found.append(
            {"name": spaced(str(row.premise)), "moved": row.moved_share} | dict(errors[["ordered", "unordered"]])
        )
    return found


def _fewer(premises: pd.DataFrame) -> pd.DataFrame:
    rows = tables.where(premises, held_out="contacts", weights=PAPERS_WEIGHTS)
    rows = rows[rows["features"].isin(["ordered", "framed"])]
    wide = rows.pivot(index=["premise", "train"], columns="features", values="ratio").reset_index()
    names = {"train": "training samples", "ordered": "ordered / unordered", "framed": "framed / unordered"}
    return wide.rename(columns=names)


def _orders(complexity: pd.DataFrame) -> pd.DataFrame:
    rows = []
    for row in complexity.to_dict("records"):
        name, order = style.OPERATIONS.get(row["operation"], row["operation"]), row["paper_order"]
        fits = (
            f"{row[f'exponent_{x}']:.2f} [{row[f'exponent_{x}_low']:.2f}, {row[f'exponent_{x}_high']:.2f}]"
            for x in "rk"
        )
        rows.append([name, order.replace("^2", "²"), *fits])
    return pd.DataFrame(rows, columns=["operation", "the paper", "exponent of r", "exponent of k"])


def _times(timing: pd.DataFrame, body: str, paper: Mapping[str, Any]) -> dict[str, Any]:
    columns, theirs = [*(f"d{i}_s" for i in range(1, 6)), "mean_s"], paper["timing"].get(body, {})
    rows: list[list[str]] = []
    faint: list[int] = []
    for row in tables.where(timing, body=body).to_dict("records"):
        name = style.short(row["method"]).replace("\n", " ")
        if row["method"] in theirs:
            faint.append(len(rows))
            times = theirs[row["method"]]
            rows.append([name, "the paper", *map(seconds, [*times, np.mean(times)])])
        rows.append([name, "this run", *(seconds(row[column]) for column in columns)])
    frame = pd.DataFrame(rows, columns=["method", "source", *(f"load {i}" for i in range(1, 6)), "mean"])
    return {"body": spaced(body), "rows": frame, "faint": faint, "number": paper["tables"].get(body)}


def failures(report: Report) -> Iterator[tuple[str, str, str]]:
    """Yield the methods without a finite error: what, where, how."""
    table = report.tables["enrichment_accuracy"]
    for row in table[~np.isfinite(table["rmse_of_peak"])].itertuples():
        where = f"{spaced(row.body)}, {spaced(row.regime)} loads, {row.protocol} protocol, {row.split} held out"
        yield style.look(row.method).label, where, "no answer"
