"""Write one page about what was found, results/report.html: one file that needs nothing else."""

import re
import warnings
from collections.abc import Collection, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from palpate.files import write_whole
from palpate.report import closing, declared, page_assets, template
from palpate.report.report import Report
from palpate.report.template import Part, Section
from palpate.run.job import load_warnings

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
    parts, told = {}, {study: report.part(study) for study in studies}
    for study, part in told.items():
        if sections := part.sections + closing.own_claims(report, study):
            parts[study] = part._replace(sections=sections)
        elif part.introduction:
            parts[study] = part
    parts |= closing.parts(report, told.values(), left_out=left_out) if studies else {}
    page = _page(parts, warned, taken, alone)
    if heavy := too_heavy(page, {name: part.sections for name, part in parts.items()}):
        warnings.warn(heavy, stacklevel=2)
        page = _page(parts, [*warned, heavy], taken, alone)
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


def _page(parts: Mapping[str, Part], warned: Sequence[str], taken: Sequence[str], alone: bool) -> str:
    """Return the whole page."""
    before = _lines("warnings", "Warnings", warned) + _lines("taken", "Taken from files", taken)
    body = (
        f'{_opening(parts, alone)}{before}\n<div class="page">\n{_navigation(parts)}\n<main>\n'
        f"{''.join(_part(name, part) for name, part in parts.items())}</main>\n</div>\n"
        f"<script>{page_assets.script()}</script>\n"
    )
    return page_assets.document("what accuracy costs", page_assets.style(), body)


def _opening(parts: Mapping[str, Part], alone: bool) -> str:
    """Show the question, the answer with its picture if a part has one, and each part's findings.

    A page about one study alone has its name in the place of the question.
    """
    name, first = next(iter(parts.items()), ("", None))
    question = escape(first.title) if alone and first else QUESTION
    answer = f"<p>One study, by <code>make {name}</code>.</p>" if alone else _answer(parts)
    findings = "\n".join(
        f'<li><a href="#{name}">{escape(part.title)}</a> <span class="finding">{" ".join(part.findings)}</span></li>'
        for name, part in parts.items()
        if part.findings
    )
    return (
        f"<header>\n<p class='name'>palpate</p>\n<h1>{question}</h1>\n{answer}\n</header>\n"
        f'<section class="findings" id="findings">\n<h2>In short</h2>\n<ul>\n{findings}\n</ul>\n</section>'
    )


def _lines(name: str, title: str, said: Sequence[str]) -> str:
    """List what jobs said; nothing if that is nothing."""
    if not said:
        return ""
    lines = "\n".join(f"<li>{escape(line)}</li>" for line in said)
    return f'\n<section class="findings" id="{name}">\n<h2>{title}</h2>\n<ul>\n{lines}\n</ul>\n</section>'


def _answer(parts: Mapping[str, Part]) -> str:
    """Show what is measured and, beside its picture, the first answer that a part offers."""
    show = template.Html(Path(), {}, declared.table)
    lead = f'<div class="lead">{show.convert(template.source(closing.HERE / "question.md", {}, show))}</div>'
    for name, part in parts.items():
        answer, figure = part.answer
        if answer:
            more = {name: "All scenes and limits"} | {key: p.invitation for key, p in parts.items() if p.invitation}
            links = " · ".join(f'<a href="#{key}">{escape(text)}</a>' for key, text in more.items())
            said = f'<div>\n{lead}\n<div class="answer">\n{answer}\n<p>{links}</p></div>\n</div>'
            return f'<div class="first">\n{said}\n{figure}\n</div>'
    return lead


def _navigation(parts: Mapping[str, Part]) -> str:
    """Link to all parts and their sections; the script marks the one that is read, and shows its sections only."""
    items = ['<li><a href="#findings">In short</a></li>']
    for name, part in parts.items():
        links = "".join(f'<li><a href="#{key}">{escape(title)}</a></li>' for key, title, _ in part.sections)
        items.append(f'<li><a href="#{name}">{escape(part.title)}</a>\n<ul>{links}</ul></li>')
    return f'<nav aria-label="sections">\n<ul>{"".join(items)}</ul>\n</nav>'


def _part(name: str, part: Part) -> str:
    """Show one part: heading, introduction, sections."""
    inside = "\n".join(
        f'<section id="{key}">\n<h3>{escape(title)}</h3>\n{content}\n</section>'
        for key, title, content in part.sections
    )
    return f'<section id="{name}">\n<h2>{escape(part.title)}</h2>\n{part.introduction}\n{inside}\n</section>\n'


def too_heavy(page: str, parts: Mapping[str, Sequence[Section]]) -> str | None:
    """Return a sentence on ``page`` if it has more than 20 MB, naming the largest of its sections; else None."""
    if (whole := _megabytes(page)) <= MOST_MB:
        return None
    sizes = [(_megabytes(content), title) for sections in parts.values() for _, title, content in sections]
    named = ", ".join(f"{title} ({size:.1f} MB)" for size, title in sorted(sizes, reverse=True)[:3])
    return f"This page has {whole:.0f} MB, more than {MOST_MB:.0f} MB; its largest sections are {named}."


def _megabytes(text: str) -> float:
    return len(text.encode()) / 1e6


def write_report(input: Any, output: Any, told: dict[str, Any]) -> None:
    """Write the page of a run from what its studies have made, for the rule of this name."""
    out = Path(output[0])
    said = sorted(file for file in input.shown if file.endswith(".txt"))
    taken = [file for file in said if file.endswith("/taken.txt")]
    warned = load_warnings(file for file in said if file not in taken)
    made = [Path(file).stem for file in input.shown if file.startswith("results/tables/")]
    write(out.parent, out, warned=warned, taken=load_warnings(taken), more=made, **told)
