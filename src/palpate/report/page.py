"""Write one page about what was found, results/report.html: one file that needs nothing else."""

import re
import warnings
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

from palpate.files import load_warnings, templates, write_whole
from palpate.report import closing, declared, page_assets, template
from palpate.report.report import Report
from palpate.report.template import Part, Section

MOST_MB = 20.0
"""A page of this size goes into a mail, and is opened within a second or two."""
QUESTION = "For this scene, how wrong is each way of simulating it, and what does a better answer cost in time?"


def write(
    results: str | Path,
    out: str | Path,
    studies: Sequence[str],
    scenes: Sequence[str] = (),
    cts: Sequence[str] = (),
    driven: Collection[str] = (),
    warned: Sequence[str] = (),
    taken: Sequence[str] = (),
    more: Sequence[str] = (),
    left_out: Sequence[str] = (),
    alone: bool = False,
) -> None:
    """Write ``out`` about ``studies``, in that order, from ``results``/tables/*.csv and ``results``/figures/*.

    A study's part is its template report.md, which names its tables and what ``numbers(report)`` of report.py beside it
    returns, where there is one. The rows of claims.csv that the study judges follow.
    scenes, cts, driven, more : as ``Report`` takes them; warned : what jobs warned of, which comes first
    taken : what bodies were made from, of files
    left_out : studies that the settings describe and this run does not compute
    alone : whether the page is about one study, whose name is then its heading
    The findings and short tables are also written as Markdown, under the name of ``out`` with .md.
    Raises InputError naming the first part, table, figure, template or number that is missing.
    """
    report = Report(results, studies, scenes, cts, driven, more)
    parts, part_of_study = {}, {study: report.part(study) for study in studies}
    for study, part in part_of_study.items():
        if sections := part.sections + closing.own_claims(report, study):
            parts[study] = part._replace(sections=sections)
        elif part.introduction:
            parts[study] = part
    parts |= closing.parts(report, part_of_study.values(), left_out=left_out) if studies else {}
    page = _page(parts, warned, taken, alone)
    if warning := too_heavy(page, {name: part.sections for name, part in parts.items()}):
        warnings.warn(warning, stacklevel=2)
        page = _page(parts, [*warned, warning], taken, alone)
    for file, text in ((out, page), (Path(out).with_suffix(".md"), _markdown(report))):
        with write_whole(file) as temporary:
            temporary.write_text(text, encoding="utf-8")


def _markdown(report: Report) -> str:
    """Return the findings, first figures and short tables of all parts as a page of Markdown."""
    parts = {study: report.part(study, template.Markdown) for study in report.studies}
    parts |= closing.parts(report, list(parts.values()), template.Markdown) if parts else {}
    text = "\n\n".join(
        "\n\n".join([f"## {part.title}", part.introduction, *(f"### {title}\n\n{inner}" for _, title, inner in shown)])
        for part in parts.values()
        if (shown := [section for section in part.sections if section[2]]) or part.introduction
    )
    return re.sub(r"\n{3,}", "\n\n", text).strip() + "\n"


def _page(parts: Mapping[str, Part], warned: Sequence[str], taken: Sequence[str], single: bool) -> str:
    """Return the whole page: the question, and the first answer that a part offers; what was found; all parts.

    A page about one study alone has its name in the place of the question.
    """
    show = template.Html(Path(), {}, declared.table)
    lead = show.convert(template.source(closing.HERE / "question.md", {}, show))
    answering = {name: part for name, part in parts.items() if part.answer[0]}
    links = {name: "All scenes and limits" for name in list(answering)[:1]}
    links |= {name: part.invitation for name, part in parts.items() if part.invitation}
    notes = [("warnings", "Warnings", warned), ("taken", "Taken from files", taken)]
    body = (
        templates(closing.HERE)
        .get_template("page.html")
        .render(parts=parts, alone=single, question=QUESTION, lead=lead, answering=answering, links=links, said=notes)
    )
    body += f"<script>{page_assets.script()}</script>\n"
    return page_assets.document("what accuracy costs", page_assets.style(), body)


def too_heavy(page: str, parts: Mapping[str, Sequence[Section]]) -> str | None:
    """Return a sentence on ``page`` if it has more than 20 MB, naming the largest of its sections; else None."""
    if (page_mb := _megabytes(page)) <= MOST_MB:
        return None
    sizes = [(_megabytes(content), title) for sections in parts.values() for _, title, content in sections]
    named = ", ".join(f"{title} ({size:.1f} MB)" for size, title in sorted(sizes, reverse=True)[:3])
    return f"This page has {page_mb:.0f} MB, more than {MOST_MB:.0f} MB; its largest sections are {named}."


def _megabytes(text: str) -> float:
    return len(text.encode()) / 1e6


def write_report(input: Any, output: Any, told: dict[str, Any]) -> None:
    """Write the page of a run from what its studies have made, for the rule of this name."""
    out = Path(output[0])
    texts = sorted(file for file in input.shown if file.endswith(".txt"))
    taken = [file for file in texts if file.endswith("/taken.txt")]
    warned = load_warnings(file for file in texts if file not in taken)
    tables = [Path(file).stem for file in input.shown if file.startswith("results/tables/")]
    write(out.parent, out, warned=warned, taken=load_warnings(taken), more=tables, **told)
