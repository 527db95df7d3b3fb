"""Work out the numbers that the captions and the headline about paper 1 name, from its tables."""

import pandas as pd

from palpate.report import style, tables
from palpate.report.material import Report
from palpate.report.names import named
from palpate.report.number_format import each, percent, seconds
from palpate.report.pareto import front
from palpate.report.words import spaced

METHOD = "detail_correction"
"""The method that is compared with those of the paper."""


def numbers(report: Report) -> dict[str, str]:
    """Return every placeholder of paper 1's captions, as text; a phrase for each body where there are several."""
    all_tables, paper = report.tables, report.published["enrichment"]
    accuracy, timing = all_tables["enrichment_accuracy"], all_tables["enrichment_timing"]
    names = tables.bodies(accuracy)
    first = accuracy["regime"].iloc[0]
    easy = tables.where(accuracy, protocol="paper", split="samples", regime=first)
    hard = tables.where(accuracy, protocol="live", split="contacts", regime=first)
    return {
        "source": paper["source"],
        "regime_first": first,
        "headline": _headline(names, hard, all_tables["online_cost"], first),
        "mesh_counts": _mesh_counts(all_tables["mesh_sizes"]),
        "samples": each(names, lambda b: _samples(tables.where(all_tables["splits"], body=b, regime=first))),
        "features_paper": "; ".join(f"{body}: {words}" for body, words in paper["features"].items()),
        "features": each(names, lambda b: _versus(easy, b, [style.PAPERS, style.BASELINE])),
        "baseline": each(names, lambda b: _versus(easy, b, ["interpolation", METHOD])),
        "live": each(names, lambda b: _versus(hard, b, [METHOD, "interpolation", style.PAPERS])),
        "premises": _premises(all_tables["premises"], all_tables["premise_bodies"]),
        "alike": _alike(all_tables["feature_vectors"]),
        "sigma": each(names, lambda b: _sigma(tables.where(all_tables["sigma_sweep"], body=b, regime=first), paper)),
        "sigma_paper": f"{paper['sigma']['value']:g}",
        "speedup": each(names, lambda b: _speedup(timing, b, paper)),
        "fem": each(names, lambda b: _fem(tables.where(all_tables["fem_cost"], body=b))),
        "orders": "; ".join(_order(row) for row in all_tables["complexity"].to_dict("records")),
        "wins": _wins(accuracy, all_tables["online_cost"]),
    }


def _errors(table, body) -> pd.Series:
    """Return RMSE / peak by method."""
    return tables.where(table, body=body).set_index("method")["rmse_of_peak"]


def _label(method: str) -> str:
    """Return a method's name inside a sentence."""
    return style.short(method).replace("\n", " ")


def _versus(table, body, methods) -> str:
    """Return the error of each of ``methods`` on one body."""
    errors = _errors(table, body)
    return ", ".join(f"{_label(m)} {percent(errors[m])}" for m in methods)


def _premises(premises, about) -> str:
    """Return the errors of ordered and unordered features in each premise, the most local first."""
    rows = tables.where(premises, held_out="contacts", weights=style.PAPERS.partition("_")[2])
    rows = rows[rows["train"] == rows.groupby("premise")["train"].transform("max")]
    parts = []
    for row in about.sort_values("moved_share", kind="stable").itertuples():
        errors = tables.where(rows, premise=row.premise).set_index("features")["rmse_of_peak"]
        parts.append(
            f"{spaced(row.premise)} ({percent(row.moved_share)} moves) {percent(errors['ordered'])} against "
            f"{percent(errors['unordered'])}"
        )
    return "; ".join(parts)


def _alike(vectors) -> str:
    """Return how many numbers each kind of feature vector has."""
    longest = 3 * (vectors.groupby("features", sort=False)["node"].max() + 1)
    return ", ".join(f"{style.FEATURES[name][0]} {count}" for name, count in longest.items())


def _headline(names, hard, cost, regime) -> str:
    """Return the finding in one sentence."""
    parts = []
    for body in names:
        errors = _errors(hard, body)
        row = tables.where(cost, body=body, protocol="live", method=METHOD)["online_median_s"]
        parts.append(
            f"{body} {percent(errors[METHOD])} in {seconds(row.iloc[0])} (linear interpolation: "
            f"{percent(errors['interpolation'])}, the paper's method: {percent(errors[style.PAPERS])})"
        )
    return (
        f"Error of {named(METHOD)} at contacts without training samples, with a coarse mesh that is really "
        f"simulated ({regime} loads): {'; '.join(parts)}."
    )


def _mesh_counts(sizes) -> str:
    """Count the surfaces that equal the paper's."""
    rows = sizes.dropna(subset=["paper_nodes"])
    if rows.empty:
        return "the paper has none of these bodies"
    equal = (rows["surface_nodes"] == rows["paper_nodes"]) & (rows["surface_triangles"] == rows["paper_triangles"])
    return f"{equal.sum()} of {len(rows)} surfaces have exactly the paper's numbers of nodes and triangles"


def _samples(rows) -> str:
    """Return how many samples train and test in each split."""
    return ", ".join(f"{r.train} to train and {r.test} to test ({r.split} held out)" for r in rows.itertuples())


def _sigma(sweep, paper) -> str:
    """Return the best σ of the paper's method on the test samples, in metres and, where known, in mesh units."""
    features, _, weights = style.PAPERS.partition("_")
    curve = tables.where(sweep, protocol="paper", split="samples", features=features, weights=weights)
    best = curve.loc[curve["rmse_of_peak"].idxmin()]
    unit_m = paper["sigma"]["unit_m"].get(best["body"])
    units = "" if unit_m is None else f" = {best['sigma_m'] / unit_m:.2g} mesh units"
    return f"{1e3 * best['sigma_m']:.2g} mm{units}"


def _speedup(timing, body, paper) -> str:
    """Return how much faster contact-ordered is than unordered, and than fine FEM, here and in the paper."""

    def ratios(mean):
        ordered = mean["contact_ordered"]
        return f"{mean['unordered'] / ordered:.2g}× and {mean['fine_fem'] / ordered:,.0f}×"

    here = tables.where(timing, body=body).set_index("method")["mean_s"]
    means = paper["means"].get(body)
    there = "" if means is None else f" (the paper: {ratios(means)})"
    return ratios(here) + there


def _fem(rows) -> str:
    """Return the median and the longest time of a fine simulation in each regime."""
    return ", ".join(
        f"{regime} loads {seconds(part.median())}, at most {seconds(part.max())}"
        for regime, part in rows.groupby("regime", sort=False)["seconds"]
    )


def _order(row) -> str:
    """Return the measured and the claimed order of one operation."""
    name = style.OPERATIONS.get(row["operation"], row["operation"])
    measured = f"r^{row['exponent_r']:.2f} k^{row['exponent_k']:.2f}"
    return f"{name} grows as {measured} (the paper: {row['paper_order'].replace('^2', '²')})"


def _wins(accuracy, cost) -> str:
    """Count the comparisons in which METHOD is more accurate than every rival, or on the Pareto front."""
    best, on_front, count = 0, 0, 0
    joined = accuracy.merge(cost, on=["body", "protocol", "method"], how="left")
    for _, rows in joined.groupby(["body", "regime", "protocol", "split"], sort=False):
        rows = rows.reset_index(drop=True)
        count += 1
        rivals = ~rows["method"].str.startswith(METHOD)
        best += rows["rmse_of_peak"][rows["method"] == METHOD].min() < rows["rmse_of_peak"][rivals].min()
        on_front += METHOD in set(rows["method"][front(rows["online_median_s"], rows["rmse_of_peak"])])
    return f"most accurate in {best} and on the Pareto front in {on_front} of {count} comparisons"
