"""Paper 1 in the report: its tables and figures beside ours, and what it leaves out."""

import numpy as np
import pandas as pd

from palpate.figures import style, tables
from palpate.figures.number_format import seconds
from palpate.report import markup
from palpate.report.material import Report

TITLE = "Enriching a coarse soft body with data"


def _paper(report: Report) -> dict:
    """The paper's own numbers."""
    return report.published["enrichment"]


def _cases(report: Report) -> list[tuple[str, str]]:
    """Body and regime of every database."""
    accuracy = report.tables["enrichment_accuracy"]
    return list(dict.fromkeys(zip(accuracy["body"], accuracy["regime"], strict=True)))


def _meshes(report: Report) -> str:
    frame = report.tables["mesh_sizes"]
    return (
        report.note("mesh_sizes")
        + markup.table(frame, "Nodes, triangles and tetrahedra of each level; the paper's counts at the right")
        + report.figure("mesh_levels")
    )


def _samples(report: Report) -> str:
    theirs = pd.DataFrame(_paper(report)["splits"]).T.rename(columns=lambda c: f"paper_{c}")
    frame = report.tables["splits"].merge(theirs, left_on="body", right_index=True, how="left")
    frame.loc[frame["split"] != "samples", theirs.columns] = np.nan
    return report.note("splits") + markup.table(frame, "Samples to train and to test; the paper's at the right")


def _deformed(report: Report) -> str:
    return report.note("deformed") + "".join(
        report.figure(f"deformed_{body}_{regime}", "deformed_bodies", body=body, regime=regime)
        for body, regime in _cases(report)
    )


def _sigma(report: Report) -> str:
    return report.figure("sigma_sweep") + markup.folded(report.tables["sigma_sweep"], "sigma_sweep")


def _complexity(report: Report) -> str:
    rows = []
    for row in report.tables["complexity"].to_dict("records"):
        name, order = style.OPERATIONS.get(row["operation"], row["operation"]), row["paper_order"]
        fits = (
            f"{row[f'exponent_{x}']:.2f} [{row[f'exponent_{x}_low']:.2f}, {row[f'exponent_{x}_high']:.2f}]"
            for x in "rk"
        )
        rows.append([name, order.replace("^2", "²"), *fits])
    frame = pd.DataFrame(rows, columns=["operation", "the paper", "exponent of r", "exponent of k"])
    title = "Table 3 of the paper: measured exponents in features r and samples k, with 95 % intervals"
    return (
        markup.table(frame, title)
        + report.figure("complexity")
        + markup.folded(report.tables["complexity"], "complexity")
    )


def _timing(report: Report) -> str:
    timing = report.tables["enrichment_timing"]
    columns = [*(f"d{i}_s" for i in range(1, 6)), "mean_s"]
    parts = [report.note("enrichment_timing")]
    for body in tables.bodies(timing):
        rows: list[list[str]] = []
        faint: list[int] = []
        theirs = _paper(report)["timing"].get(body, {})
        for row in tables.where(timing, body=body).to_dict("records"):
            name = style.short(row["method"]).replace("\n", " ")
            if row["method"] in theirs:
                faint.append(len(rows))
                times = theirs[row["method"]]
                rows.append([name, "the paper", *map(seconds, [*times, np.mean(times)])])
            rows.append([name, "ours", *(seconds(row[column]) for column in columns)])
        frame = pd.DataFrame(rows, columns=["method", "whose", *(c.removesuffix("_s") for c in columns)])
        number = _paper(report)["tables"].get(body)
        title = f"{body}: time a deformation" + (f", table {number} of the paper" if number else "")
        parts.append(markup.table(frame, title, faint))
    return "".join(parts) + report.figure("timing_bars")


def _claims(report: Report) -> str:
    return report.note("claims") + markup.table(report.tables["claims"], "Each claim of the paper, and what we measure")


def _left_out(report: Report) -> str:
    accuracy = report.tables["enrichment_accuracy"]
    parts = [report.note("left_out")]
    for body, regime in _cases(report):
        rows = tables.where(accuracy, body=body, regime=regime)
        rows = rows.assign(case=rows["protocol"] + ", " + rows["split"] + " held out", error=100 * rows["rmse_of_peak"])
        wide = rows.pivot(index="method", columns="case", values="error")
        wide = wide.reindex(index=rows["method"].unique(), columns=rows["case"].unique())
        cases = list(wide.columns)
        wide.insert(0, "method", [style.look(m).label for m in wide.index])
        title = f"{body}, {regime} loads: RMSE [% of peak], mean over test samples; least in bold, – if it failed"
        parts.append(markup.table(wide, title, best=cases))
        name, about = f"error_over_body_{body}_{regime}", {"body": body, "regime": regime}
        parts.append(report.turnable(name, f"error over the {body}, {regime} loads", "error_to_turn", **about))
        parts.append(report.figure(name, "error_over_body", **about))
    return "".join(parts) + markup.folded(accuracy, "enrichment_accuracy")


def _cost(report: Report) -> str:
    return (
        report.figure("accuracy_vs_time")
        + markup.folded(report.tables["online_cost"], "online_cost")
        + report.figure("fem_cost")
        + markup.folded(report.tables["fem_cost"], "fem_cost")
    )


def sections(report: Report) -> list[tuple[str, str, str]]:
    """Identifier, heading and content of each section, in order."""
    return [(key, title, section(report)) for key, (title, section) in SECTIONS.items()]


SECTIONS = {
    "meshes": ("Meshes", _meshes),
    "samples": ("Samples", _samples),
    "deformed": ("Deformed bodies", _deformed),
    "sigma": ("Kernel width", _sigma),
    "complexity": ("Complexity", _complexity),
    "timing": ("Times", _timing),
    "claims": ("The paper's claims", _claims),
    "left-out": ("What the paper leaves out", _left_out),
    "cost": ("Accuracy and time", _cost),
}
"""Identifier, heading and content of each section, in order."""
