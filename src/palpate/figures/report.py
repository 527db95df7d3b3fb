"""One page with everything that was found: results/report.html, self-contained."""

from collections.abc import Collection
from html import escape
from pathlib import Path

from palpate.errors import InputError
from palpate.figures import (
    sections_collision,
    sections_ct,
    sections_enrichment,
    sections_scenes,
    sections_soft_bodies,
    sections_springs,
)
from palpate.figures.css import CSS
from palpate.figures.page import Report
from palpate.files import write_whole

PARTS = {
    "ct": sections_ct,
    "scenes": sections_scenes,
    "soft_bodies": sections_soft_bodies,
    "collision": sections_collision,
    "springs": sections_springs,
    "enrichment": sections_enrichment,
}
"""What the page can hold, in order: a heading, an introduction (the caption of that name) and sections each."""

QUESTION = "For each scene, how wrong is each way of simulating it, and what does a better answer cost in time?"


def write(
    results: str | Path,
    captions: str | Path,
    out: str | Path,
    papers: list[str],
    scenes: list[str],
    cts: list[str],
    driven: Collection[str] = (),
) -> None:
    """Write ``out`` about ``papers`` and ``scenes`` from ``results``/tables/*.csv and ``results``/figures/*.

    cts : names of the bodies that are made from a CT; driven : those of the scenes in which an instrument is moved
    captions : the folder with one .rst a caption, and the papers' own numbers
    Raises InputError naming the first table, figure, caption or number that is missing, or a paper unknown here.
    """
    unknown = [paper for paper in papers if paper not in PARTS]
    if unknown:
        raise InputError(f"papers names {unknown[0]}, which the report does not know; choose from {', '.join(PARTS)}.")
    asked = [part for part in PARTS if part in papers or {"scenes": scenes, "ct": cts}.get(part)]
    report = Report(Path(results), Path(captions), asked, scenes, cts, driven)
    sections = {part: PARTS[part].sections(report) for part in asked}
    headlines = "\n".join(f'<p class="headline">{escape(report.numbers[f"headline_{part}"])}</p>' for part in asked)
    page = (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>palpate: what was found</title>\n<style>{CSS}</style>\n</head>\n<body>\n"
        f"<header>\n<h1>palpate</h1>\n<p>{QUESTION}</p>\n{headlines}\n</header>\n"
        f"{_navigation(sections)}\n<main>\n"
        f"{''.join(_part(report, part, content) for part, content in sections.items())}</main>\n</body>\n</html>\n"
    )
    with write_whole(out) as part:
        part.write_text(page, encoding="utf-8")


def _navigation(sections: dict[str, list]) -> str:
    """A line of links a part."""
    lines = []
    for part, content in sections.items():
        links = "".join(f'<li><a href="#{key}">{escape(title)}</a></li>' for key, title, _ in content)
        lines.append(f'<p><a href="#{part}">{PARTS[part].TITLE}</a></p>\n<ul>{links}</ul>')
    return f'<nav aria-label="sections">{"".join(lines)}</nav>'


def _part(report: Report, part: str, content: list) -> str:
    """One part: heading, introduction, sections."""
    sections = "\n".join(
        f'<section id="{key}">\n<h3>{escape(title)}</h3>\n{inside}\n</section>' for key, title, inside in content
    )
    introduction = report.note(f"introduction_{part}")
    return f'<section id="{part}">\n<h2>{PARTS[part].TITLE}</h2>\n{introduction}\n{sections}\n</section>\n'
