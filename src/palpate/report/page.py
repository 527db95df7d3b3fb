"""One page that tells what was found, as a story: results/report.html, self-contained."""

from collections.abc import Collection
from html import escape
from pathlib import Path

from palpate.errors import InputError
from palpate.files import write_whole
from palpate.report import page_assets
from palpate.report.material import Report
from palpate.report.parts import (
    claims_table,
    collision,
    ct,
    dynamic,
    enrichment,
    hard_cases,
    models,
    omissions,
    scaling,
    shape_matching,
    springs,
    tradeoff,
)
from palpate.report.parts import scenes as sections_scenes

PARTS = {
    "models": models,
    "tradeoff": tradeoff,
    "dynamic": dynamic,
    "hard_cases": hard_cases,
    "scaling": scaling,
    "scenes": sections_scenes,
    "ct": ct,
    "verdicts": claims_table,
    "enrichment": enrichment,
    "springs": springs,
    "soft_bodies": shape_matching,
    "collision": collision,
    "omissions": omissions,
}
"""The story: what the page can hold, in order. Each part has a heading, an introduction (the caption
introduction_<part>), a number headline_<part> if it has a finding to tell, and sections."""

PAPERS = ("enrichment", "springs", "soft_bodies", "collision")
"""The parts that reproduce a paper and so have claims to be checked."""

QUESTION = "For each scene, how wrong is each way of simulating it, and what does a better answer cost in time?"


def write(
    results: str | Path,
    captions: str | Path,
    out: str | Path,
    parts: Collection[str],
    scenes: list[str],
    cts: list[str],
    driven: Collection[str] = (),
) -> None:
    """Write ``out`` about ``parts`` and ``scenes`` from ``results``/tables/*.csv and ``results``/figures/*.

    parts : of PARTS; those about scenes, CT, verdicts, models and omissions come by themselves where they apply
    cts : names of the bodies that are made from a CT; driven : those of the scenes in which an instrument is moved
    captions : the folder with one .rst a caption, and the papers' own numbers
    Raises InputError naming the first table, figure, caption or number that is missing, or a part unknown here.
    """
    asked = _asked(parts, scenes, cts)
    report = Report(Path(results), Path(captions), asked, scenes, cts, driven)
    sections = {part: PARTS[part].sections(report) for part in asked}
    page = (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{page_assets.POLICY}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>palpate: what accuracy costs</title>\n<style>{page_assets.style()}</style>\n</head>\n<body>\n"
        f'{_opening(report, asked)}\n<div class="page">\n{_navigation(sections)}\n<main>\n'
        f"{''.join(_part(report, part, content) for part, content in sections.items())}</main>\n</div>\n"
        f"<script>{page_assets.script()}</script>\n</body>\n</html>\n"
    )
    with write_whole(out) as part:
        part.write_text(page, encoding="utf-8")


def _asked(parts: Collection[str], scenes: list[str], cts: list[str]) -> list[str]:
    """The parts in the order of the story, with those that come by themselves."""
    unknown = [part for part in parts if part not in PARTS]
    if unknown:
        raise InputError(f"The report has no part {unknown[0]}; choose from {', '.join(PARTS)}.")
    follows = {
        "models": "tradeoff" in parts,
        "scenes": scenes,
        "ct": cts,
        "verdicts": any(part in PAPERS for part in parts),
        "omissions": parts,
    }
    return [part for part in PARTS if part in parts or follows.get(part)]


def _opening(report: Report, asked: list[str]) -> str:
    """The question, how to read the page, and each part's finding in a sentence."""
    found = {part: report.numbers[f"headline_{part}"] for part in asked if f"headline_{part}" in report.numbers}
    short = "\n".join(
        f'<li><a href="#{part}">{PARTS[part].TITLE}</a> <span class="finding">{escape(sentence)}</span></li>'
        for part, sentence in found.items()
    )
    return (
        f'<header>\n<div>\n<h1>palpate</h1>\n<p class="question">{QUESTION}</p>\n'
        f'<div class="lead">{report.note("question")}</div>\n<ul class="short">\n{short}\n</ul>\n</div>\n</header>'
    )


def _navigation(sections: dict[str, list]) -> str:
    """Links to all parts and their sections."""
    items = []
    for part, content in sections.items():
        links = "".join(f'<li><a href="#{key}">{escape(title)}</a></li>' for key, title, _ in content)
        items.append(f'<li><a href="#{part}">{PARTS[part].TITLE}</a>\n<ul>{links}</ul></li>')
    return f'<nav aria-label="sections">\n<ul>{"".join(items)}</ul>\n</nav>'


def _part(report: Report, part: str, content: list) -> str:
    """One part: heading, introduction, sections."""
    sections = "\n".join(
        f'<section id="{key}">\n<h3>{escape(title)}</h3>\n{inside}\n</section>' for key, title, inside in content
    )
    introduction = report.note(f"introduction_{part}")
    return f'<section id="{part}">\n<h2>{PARTS[part].TITLE}</h2>\n{introduction}\n{sections}\n</section>\n'
