"""One page with everything that was found: results/report.html, self-contained."""

from html import escape
from pathlib import Path

import numpy as np
import pandas as pd

from palpate.figures import markup, style, tables
from palpate.figures.css import CSS
from palpate.figures.summary import numbers, seconds
from palpate.files import read_yaml, write_whole


class _Report:
    """What all sections need: the tables, the paper's numbers and the captions filled with ours."""

    def __init__(self, results: Path, captions: Path):
        self.figures, self._captions = results / "figures", captions
        self.paper = read_yaml(captions / "paper.yaml")
        self.tables = tables.read_all(results / "tables")
        self.numbers = numbers(self.tables, self.paper)

    def note(self, name: str, **more: str) -> str:
        """A caption by name; ``more`` holds what differs between its uses."""
        return markup.caption(self._captions, name, self.numbers | more)

    def figure(self, name: str, caption: str | None = None, **more: str) -> str:
        """A figure under the caption of its own name or of ``caption``."""
        return markup.figure(self.figures, name, self.note(caption or name, **more))

    def cases(self) -> list[tuple[str, str]]:
        """Body and regime of every database."""
        accuracy = self.tables["enrichment_accuracy"]
        return list(dict.fromkeys(zip(accuracy["body"], accuracy["regime"], strict=True)))


def write(results: str | Path, captions: str | Path, out: str | Path) -> None:
    """Write ``out`` from ``results``/tables/*.csv, ``results``/figures/* and the captions.

    captions : the folder with one .rst a caption and paper.yaml, the paper's own numbers
    Raises InputError naming the first table, figure, caption or number that is missing.
    """
    report = _Report(Path(results), Path(captions))
    sections = "\n".join(
        f'<section id="{key}">\n<h2>{title}</h2>\n{section(report)}\n</section>'
        for key, (title, section) in SECTIONS.items()
    )
    links = "".join(f'<li><a href="#{key}">{title}</a></li>' for key, (title, _) in SECTIONS.items())
    page = (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>palpate: paper 1, enrichment</title>\n<style>{CSS}</style>\n</head>\n<body>\n"
        f"<header>\n<h1>Enriching a coarse soft body with data</h1>\n"
        f'<p class="headline">{escape(report.numbers["headline"])}</p>\n'
        f"{report.note('introduction')}\n</header>\n"
        f'<nav aria-label="sections"><ul>{links}</ul></nav>\n<main>\n{sections}\n</main>\n</body>\n</html>\n'
    )
    with write_whole(out) as part:
        part.write_text(page, encoding="utf-8")


def _meshes(report) -> str:
    frame = report.tables["mesh_sizes"]
    return (
        report.note("mesh_sizes")
        + markup.table(frame, "Nodes, triangles and tetrahedra of each level; the paper's counts at the right")
        + report.figure("mesh_levels")
    )


def _samples(report) -> str:
    theirs = pd.DataFrame(report.paper["splits"]).T.rename(columns=lambda c: f"paper_{c}")
    frame = report.tables["splits"].merge(theirs, left_on="body", right_index=True, how="left")
    frame.loc[frame["split"] != "samples", theirs.columns] = np.nan
    return report.note("splits") + markup.table(frame, "Samples to train and to test; the paper's at the right")


def _deformed(report) -> str:
    return report.note("deformed") + "".join(
        report.figure(f"deformed_{body}_{regime}", "deformed_bodies", body=body, regime=regime)
        for body, regime in report.cases()
    )


def _sigma(report) -> str:
    return report.figure("sigma_sweep") + markup.folded(report.tables["sigma_sweep"], "sigma_sweep")


def _complexity(report) -> str:
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


def _timing(report) -> str:
    timing = report.tables["enrichment_timing"]
    columns = [*(f"d{i}_s" for i in range(1, 6)), "mean_s"]
    parts = [report.note("enrichment_timing")]
    for body in tables.bodies(timing):
        rows, faint = [], []
        theirs = report.paper["timing"].get(body, {})
        for row in tables.where(timing, body=body).to_dict("records"):
            name = style.short(row["method"]).replace("\n", " ")
            if row["method"] in theirs:
                faint.append(len(rows))
                times = theirs[row["method"]]
                rows.append([name, "the paper", *map(seconds, [*times, np.mean(times)])])
            rows.append([name, "ours", *(seconds(row[column]) for column in columns)])
        frame = pd.DataFrame(rows, columns=["method", "whose", *(c.removesuffix("_s") for c in columns)])
        number = report.paper["tables"].get(body)
        title = f"{body}: time a deformation" + (f", table {number} of the paper" if number else "")
        parts.append(markup.table(frame, title, faint))
    return "".join(parts) + report.figure("timing_bars")


def _claims(report) -> str:
    return report.note("claims") + markup.table(report.tables["claims"], "Each claim of the paper, and what we measure")


def _left_out(report) -> str:
    accuracy = report.tables["enrichment_accuracy"]
    parts = [report.note("left_out")]
    for body, regime in report.cases():
        rows = tables.where(accuracy, body=body, regime=regime)
        rows = rows.assign(case=rows["protocol"] + ", " + rows["split"] + " held out", error=100 * rows["rmse_of_peak"])
        wide = rows.pivot(index="method", columns="case", values="error")
        wide = wide.reindex(index=rows["method"].unique(), columns=rows["case"].unique())
        cases = list(wide.columns)
        wide.insert(0, "method", [style.look(m).label for m in wide.index])
        title = f"{body}, {regime} loads: RMSE [% of peak], mean over test samples; least in bold, – if it failed"
        parts.append(markup.table(wide, title, best=cases))
        parts.append(report.figure(f"error_over_body_{body}_{regime}", "error_over_body", body=body, regime=regime))
    return "".join(parts) + markup.folded(accuracy, "enrichment_accuracy")


def _cost(report) -> str:
    return (
        report.figure("accuracy_vs_time")
        + markup.folded(report.tables["online_cost"], "online_cost")
        + report.figure("fem_cost")
        + markup.folded(report.tables["fem_cost"], "fem_cost")
    )


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
