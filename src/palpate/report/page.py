"""Write one page about what was found, results/report.html: one file that needs nothing else."""

import warnings
from collections.abc import Collection, Sequence
from html import escape
from pathlib import Path

from palpate.files import write_whole
from palpate.report import omissions, page_assets, paper_claims, pictures, verdicts
from palpate.report.material import Report, Section
from palpate.report.weight import too_heavy

LAST = {"verdicts": verdicts, "omissions": omissions}
"""The parts that belong to no study, by name; they come last."""

QUESTION = "For this scene, how wrong is each way of simulating it, and what does a better answer cost in time?"


def write(
    results: str | Path,
    out: str | Path,
    studies: Sequence[str],
    scenes: Sequence[str] = (),
    cts: Sequence[str] = (),
    driven: Collection[str] = (),
    warned: Sequence[str] = (),
    more: Sequence[str] = (),
) -> None:
    """Write ``out`` about ``studies``, in that order, from ``results``/tables/*.csv and ``results``/figures/*.

    A study's part is palpate.studies.<study>.report: TITLE, TABLES, numbers(report), sections(report), and where it
    has some failures(report). The rows of claims.csv that the study judges follow. Its captions are
    palpate/studies/<study>/captions/*.rst.
    scenes, cts, driven : names of the scenes that move, of the bodies from a CT, and of the scenes with an instrument
    warned : what jobs warned of, which comes first
    more : names of the tables of this run that not every run of their studies makes
    Raises InputError naming the first part, table, figure, caption or number that is missing.
    """
    report = Report(results, studies, scenes, cts, driven, LAST if studies else {}, more)
    parts = {
        name: part.sections(report.of(name)) + paper_claims.section(report, name) for name, part in report.parts.items()
    }
    parts = {name: sections for name, sections in parts.items() if sections}
    page = _page(report, parts, warned)
    if heavy := too_heavy(page, parts):
        warnings.warn(heavy, stacklevel=2)
        page = _page(report, parts, [*warned, heavy])
    with write_whole(out) as part:
        part.write_text(page, encoding="utf-8")


def _page(report: Report, parts: dict[str, list[Section]], warned: Sequence[str]) -> str:
    """Return the whole page."""
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{page_assets.POLICY}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>palpate: what accuracy costs</title>\n<style>{page_assets.style()}</style>\n</head>\n<body>\n"
        f'{_opening(report, parts)}{_warnings(warned)}\n<div class="page">\n{_navigation(report, parts)}\n<main>\n'
        f"{''.join(_part(report, name, sections) for name, sections in parts.items())}</main>\n</div>\n"
        f"<script>{page_assets.script()}</script>\n</body>\n</html>\n"
    )


def _opening(report: Report, parts: Collection[str]) -> str:
    """Show the question, the answer with its picture if a part has one, and each part's finding in a sentence."""
    found = {name: report.numbers[name]["headline"] for name in parts if "headline" in report.numbers[name]}
    findings = "\n".join(
        f'<li><a href="#{name}">{report.parts[name].TITLE}</a> <span class="finding">{escape(sentence)}</span></li>'
        for name, sentence in found.items()
    )
    return (
        f"<header>\n<p class='name'>palpate</p>\n<h1>{QUESTION}</h1>\n{_answer(report)}\n</header>\n"
        f'<section class="findings" id="findings">\n<h2>In short</h2>\n<ul>\n{findings}\n</ul>\n</section>'
    )


def _warnings(warned: Sequence[str]) -> str:
    """List what jobs warned of; nothing if that is nothing."""
    if not warned:
        return ""
    lines = "\n".join(f"<li>{escape(line)}</li>" for line in warned)
    return f'\n<section class="findings" id="warnings">\n<h2>Warnings</h2>\n<ul>\n{lines}\n</ul>\n</section>'


def _answer(report: Report) -> str:
    """Show what is measured and, beside its picture, the first answer that a part offers."""
    lead = f'<div class="lead">{report.of("").note("question")}</div>'
    for name in report.studies:
        numbers = report.numbers[name]
        if "answer" in numbers:
            first, *sentences = numbers["answer"].split("\n")
            answer = "".join(f"<p>{escape(sentence)}</p>" for sentence in sentences)
            picture = pictures.image(report.figures / numbers["picture"], f"error against time: {numbers['hardest']}")
            return (
                f'<div class="first">\n<div>\n{lead}\n<div class="answer">\n<p><b>{escape(first)}</b></p>\n{answer}'
                f'<p><a href="#{name}">All scenes and limits</a></p></div>\n</div>\n'
                f"<figure>{picture}<figcaption>{report.of(name).note('best_models')}</figcaption></figure>\n</div>"
            )
    return lead


def _navigation(report: Report, parts: dict[str, list[Section]]) -> str:
    """Link to all parts and their sections; the script marks the one that is read, and shows its sections only."""
    items = ['<li><a href="#findings">In short</a></li>']
    for name, sections in parts.items():
        links = "".join(f'<li><a href="#{key}">{escape(title)}</a></li>' for key, title, _ in sections)
        items.append(f'<li><a href="#{name}">{escape(report.parts[name].TITLE)}</a>\n<ul>{links}</ul></li>')
    return f'<nav aria-label="sections">\n<ul>{"".join(items)}</ul>\n</nav>'


def _part(report: Report, name: str, sections: list[Section]) -> str:
    """Show one part: heading, introduction, sections."""
    inside = "\n".join(
        f'<section id="{key}">\n<h3>{escape(title)}</h3>\n{content}\n</section>' for key, title, content in sections
    )
    introduction = report.of(name).note("introduction" if name in report.studies else name)
    return f'<section id="{name}">\n<h2>{escape(report.parts[name].TITLE)}</h2>\n{introduction}\n{inside}\n</section>\n'
