"""Report on paper 1: its tables and figures beside those of this run, and the comparisons that it leaves out."""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from palpate.report import markup, style, tables
from palpate.report.material import Report, Section
from palpate.report.number_format import seconds
from palpate.report.words import capital, spaced
from palpate.studies.enrichment.report_numbers import numbers
from palpate.studies.enrichment.tables import TABLES

__all__ = ["TABLES", "TITLE", "failures", "numbers", "sections"]

TITLE = "Paper 1: enriching a coarse simulation"
PAPERS_WEIGHTS = "nonnegative_a"


def _cases(report: Report) -> list[tuple[str, str, str]]:
    """Return body and regime of every database, and both in words."""
    accuracy = report.tables["enrichment_accuracy"]
    found = dict.fromkeys(zip(accuracy["body"], accuracy["regime"], strict=True))
    return [(body, regime, f"{capital(spaced(body))}, {spaced(regime)} loads") for body, regime in found]


def _meshes(report: Report) -> str:
    return report.note("mesh_sizes") + report.figure("mesh_levels") + report.folded("mesh_sizes")


def _samples(report: Report) -> str:
    theirs = pd.DataFrame(report.published["enrichment"]["splits"]).T.rename(columns=lambda c: f"paper_{c}")
    frame = report.tables["splits"].merge(theirs, left_on="body", right_index=True, how="left")
    frame.loc[frame["split"] != "samples", theirs.columns] = np.nan
    frame = frame.rename(columns={"split": "held out"})
    return report.note("splits") + markup.table(frame, "Samples to train and to test; the paper's at the right")


def _deformed(report: Report) -> str:
    """Show the first body, and fold the others."""
    shown = [report.picture(f"deformed_{body}_{regime}", title) for body, regime, title in _cases(report)]
    return report.note("deformed") + shown[0] + _rest("Other bodies and loads", shown[1:])


def _rest(summary: str, parts: list[str]) -> str:
    return markup.fold(summary, "".join(parts)) if parts else ""


def _sigma(report: Report) -> str:
    return report.figure("sigma_sweep") + report.folded("sigma_sweep")


def _vectors(report: Report) -> str:
    return report.figure("feature_vectors") + report.folded("feature_vectors")


def _premises(report: Report) -> str:
    """Show the comparison in every premise, and what the database takes."""
    rows = report.tables["premises"]
    rows = rows[(rows["held_out"] == "contacts") & rows["features"].isin(["ordered", "framed"])]
    fewest = tables.where(rows, weights=PAPERS_WEIGHTS)
    wide = fewest.pivot(index=["premise", "train"], columns="features", values="ratio").reset_index()
    wide = wide.rename(
        columns={"train": "training samples", "ordered": "ordered / unordered", "framed": "framed / unordered"}
    )
    title = "Fewer training samples: errors over those of unordered features that learn from as many"
    folded = report.folded("premises", "premise_bodies", "database_memory")
    return report.figure("premises") + markup.table(wide, title) + folded


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
    return markup.table(frame, title) + report.figure("complexity") + report.folded("complexity")


def _timing(report: Report) -> str:
    timing, paper = report.tables["enrichment_timing"], report.published["enrichment"]
    columns = [*(f"d{i}_s" for i in range(1, 6)), "mean_s"]
    parts = []
    for body in tables.bodies(timing):
        rows: list[list[str]] = []
        faint: list[int] = []
        theirs = paper["timing"].get(body, {})
        for row in tables.where(timing, body=body).to_dict("records"):
            name = style.short(row["method"]).replace("\n", " ")
            if row["method"] in theirs:
                faint.append(len(rows))
                times = theirs[row["method"]]
                rows.append([name, "the paper", *map(seconds, [*times, np.mean(times)])])
            rows.append([name, "this run", *(seconds(row[column]) for column in columns)])
        frame = pd.DataFrame(rows, columns=["method", "source", *(f"load {i}" for i in range(1, 6)), "mean"])
        number = paper["tables"].get(body)
        title = f"{capital(spaced(body))}: time of an answer" + (f", table {number} of the paper" if number else "")
        parts.append(markup.table(frame, title, faint))
    times = markup.fold("Tables 4 and 5 of the paper: the times of five loads", "".join(parts))
    return report.note("enrichment_timing") + report.figure("timing_bars") + times


def _left_out(report: Report) -> str:
    """Show every method's error, and where it lies, body by body; the first open, the others folded."""
    parts = [
        markup.fold(title, _errors(report, body, regime, title), opened=not i)
        for i, (body, regime, title) in enumerate(_cases(report))
    ]
    return (
        report.note("left_out") + report.note("error_over_body") + "".join(parts) + report.folded("enrichment_accuracy")
    )


def _errors(report: Report, body: str, regime: str, title: str) -> str:
    """Show a view of the errors on one body, a picture of them, and their table."""
    rows = tables.where(report.tables["enrichment_accuracy"], body=body, regime=regime)
    rows = rows.assign(case=rows["protocol"] + ", " + rows["split"] + " held out", error=100 * rows["rmse_of_peak"])
    wide = rows.pivot(index="method", columns="case", values="error")
    wide = wide.reindex(index=rows["method"].unique(), columns=rows["case"].unique())
    cases = list(wide.columns)
    wide.insert(0, "method", [style.look(m).label for m in wide.index])
    about = "RMSE [% of peak], mean over test samples; the least in bold, – if the method failed"
    name = f"error_over_body_{body}_{regime}"
    return (
        report.turnable(name, f"Error over the body: {title}", report.note("error_to_turn"))
        + report.picture(name, title)
        + markup.table(wide, f"{title}: {about}", best=cases)
    )


def _cost(report: Report) -> str:
    return (
        report.figure("accuracy_vs_online_cost")
        + report.folded("online_cost")
        + report.figure("fem_cost")
        + report.folded("fem_cost", "sample_peaks")
    )


def failures(report: Report) -> Iterator[tuple[str, str, str]]:
    """Yield the methods without a finite error: what, where, how."""
    table = report.tables["enrichment_accuracy"]
    for row in table[~np.isfinite(table["rmse_of_peak"])].itertuples():
        where = f"{spaced(row.body)}, {spaced(row.regime)} loads, {row.protocol} protocol, {row.split} held out"
        yield style.look(row.method).label, where, "no answer"


def sections(report: Report) -> list[Section]:
    """Return identifier, heading and content of each section, in order."""
    return [(key, title, section(report)) for key, (title, section) in SECTIONS.items()]


SECTIONS = {
    "meshes": ("Meshes", _meshes),
    "samples": ("Samples", _samples),
    "deformed": ("Deformed bodies", _deformed),
    "vectors": ("Feature vectors", _vectors),
    "sigma": ("Kernel width", _sigma),
    "premises": ("Within the paper's premise", _premises),
    "complexity": ("Complexity", _complexity),
    "timing": ("Times", _timing),
    "left-out": ("What the paper leaves out", _left_out),
    "cost": ("Accuracy and time", _cost),
}
"""Identifier, heading and content of each section, in order."""
