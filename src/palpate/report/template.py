"""Render a part of the report from its template: one Markdown file with Jinja's placeholders, for HTML and Markdown.

A template begins with its title, names tables and numbers, ``{{ errors | span }}``, and calls ``figure``, ``turnable``,
``embedded``, ``table``, ``folded``, ``invite``, ``failure`` and, with a text inside
(``{% call fold("How to read it") %} ... {% endcall %}``), ``fold``, ``finding`` and ``answer``.
"""

import re
import traceback
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from html import escape
from pathlib import Path
from typing import Any, NamedTuple

import jinja2
import pandas as pd
from markdown_it import MarkdownIt

from palpate.errors import InputError
from palpate.files import require_file, templates
from palpate.report import markup, tables
from palpate.report.model_looks import label, named, plain
from palpate.report.words import capital, listed, metres, pascals, percent, seconds, spaced, span

_KEPT, _KEPT_ALONE = re.compile("\ue000(\\d+)\ue001"), re.compile("<p>\ue000(\\d+)\ue001</p>")
_SPECIAL = re.compile(r"([\\`*_{}\[\]<>|#])")
_SECTION = re.compile(r"^## (.+)$", re.MULTILINE)
_TITLE = re.compile(r"\A# (.+)$", re.MULTILINE)
WRITTEN: dict[str, Callable[..., str]] = {"percent": percent, "seconds": seconds, "metres": metres, "pascals": pascals}
WRITTEN |= {"spaced": spaced, "named": named, "label": label}
"""How a template writes a value: ``{{ error | percent }}``, ``{{ errors | span(seconds) }}``."""
FILTERS = WRITTEN | {"capital": capital, "listed": listed, "plain": plain, "span": span}
FILTERS |= {"headed": tables.headed, "where": tables.where}
"""What a template may do to values and tables: ``{{ table(errors | where(body="liver")) }}``."""

Section = tuple[str, str, str]
"""A section of a part: its identifier on the page, its heading, and its content."""


class Part(NamedTuple):
    """A part of the report: its title, the sentences found first, what stands before the sections, and the sections.

    answer : what the first screen says, and the figure beside it; both empty for most parts
    invitation : what the first screen's link to this part says; empty for most parts
    failures : what failed, where and how
    """

    title: str
    findings: list[str]
    introduction: str
    sections: list[Section]
    answer: tuple[str, str] = ("", "")
    invitation: str = ""
    failures: Sequence[tuple[str, str, str]] = ()


class _Text(str):
    """A string that is Markdown already."""


class Html:
    """Show what a template calls for as HTML.

    figures : the folder of the figures; tables : all tables by name; describe : returns the declaration of a table
    """

    def __init__(self, figures: Path, tables: Mapping[str, pd.DataFrame], describe: Callable):
        self.folder, self.tables, self.describe = figures, tables, describe
        self.kept: list[str] = []
        self.findings: list[str] = []
        self.answered = ("", "")
        self.invitation = ""
        self.failures: list[tuple[str, str, str]] = []

    def keep(self, html: str) -> _Text:
        """Return the placeholder of a piece that Markdown must not touch."""
        self.kept.append(html)
        return _Text(f"\n\n\ue000{len(self.kept) - 1}\ue001\n\n")

    def convert(self, text: str) -> str:
        """Return Markdown as HTML, with all pieces in their places."""
        html = _markdown().render(text).strip()
        for pattern in (_KEPT_ALONE, _KEPT):
            html = pattern.sub(lambda match: self.kept[int(match[1])], html)
        return html

    def figure(self, name: str, caption: str = "", small: str | None = None) -> _Text:
        """Show a figure; on narrow screens the figure ``small`` in its place."""
        return self.keep(markup.figure(self.folder, name, self.convert(caption), small))

    def turnable(self, name: str, title: str, caption: str = "") -> _Text:
        """Show a view that turns."""
        return self.keep(markup.turnable(self.folder, name, title, self.convert(caption)))

    def table(
        self, frame: pd.DataFrame, caption: str = "", faint: Sequence[int] = (), best: Sequence[str] = ()
    ) -> _Text:
        """Show a data frame; nothing if it has no rows."""
        return self.keep(markup.table(frame, caption, faint, best)) if len(frame) else _Text("")

    def folded(self, *names: str) -> _Text:
        """Show whole tables, closed at first, with the meanings of their columns; none that this run lacks."""
        shown = [markup.folded(self.tables[name], self.describe(name)) for name in names if name in self.tables]
        return self.keep("".join(shown))

    def embedded(self, name: str) -> _Text:
        """Show a piece of a page that a job has written beside the figures; InputError if it is missing."""
        return self.keep(require_file(self.folder / name).read_text(encoding="utf-8"))

    def fold(self, summary: str, caller: Callable[[], str]) -> _Text:
        """Show a text, closed at first."""
        return self.keep(markup.fold(summary, self.convert(caller())))

    def finding(self, caller: Callable[[], str]) -> _Text:
        """Show what was found, in a sentence; the first screen has it, too."""
        self.findings.append(_markdown().renderInline(" ".join(caller().split())))
        return self.keep(f'<p class="found">{self.findings[-1]}</p>')

    def answer(self, picture: str, alt: str, caption: str, caller: Callable[[], str]) -> _Text:
        """Keep what the first screen says beside a picture."""
        shown = markup.image(self.folder / picture, alt)
        figure = f"<figure>{shown}<figcaption>{escape(caption)}</figcaption></figure>"
        self.answered = self.convert(caller()), figure
        return _Text("")

    def invite(self, text: str) -> _Text:
        """Keep what the first screen's link to this part says."""
        self.invitation = text
        return _Text("")

    def failure(self, what: str, where: str, how: str) -> _Text:
        """Keep what failed for the list at the end of the page."""
        self.failures.append((what, where, how))
        return _Text("")


class Markdown(Html):
    """Show what a template calls for in a page of Markdown: a part's first figure and short tables."""

    LONGEST = 12  # rows of a table

    def __init__(self, figures: Path, tables: Mapping[str, pd.DataFrame], describe: Callable):
        super().__init__(figures, tables, describe)
        self.shown: list[str] = []

    def convert(self, text: str) -> str:
        return text.strip()

    def figure(self, name: str, caption: str = "", small: str | None = None) -> _Text:
        if self.shown:
            return _Text("")
        self.shown.append(name)
        return _Text(f"\n\n![{name.replace('_', ' ')}](figures/{name}.png)\n\n")

    def table(
        self, frame: pd.DataFrame, caption: str = "", faint: Sequence[int] = (), best: Sequence[str] = ()
    ) -> _Text:
        cells = [[markup.text(cell).replace("|", "\\|") for cell in row] for row in frame.itertuples(index=False)]
        if not 0 < len(cells) <= self.LONGEST:
            return _Text("")
        lines = [[spaced(str(column)) for column in frame], ["---"] * frame.shape[1], *cells]
        return _Text("\n\n" + "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n\n")

    def finding(self, caller: Callable[[], str]) -> _Text:
        self.findings.append(" ".join(caller().split()))
        return _Text(f"\n\n**{self.findings[-1]}**\n\n")

    def _nothing(self, *_: Any, **__: Any) -> _Text:
        return _Text("")

    turnable = embedded = folded = fold = answer = _nothing


def render(path: Path, name: str, values: Mapping[str, Any], show: Html) -> Part:
    """Render the part ``name`` from the template ``path``, which begins with its title, with ``values``.

    Raises InputError that names the file, and the line or the number, if the template is wrong.
    """
    text = source(path, values, show)
    if not (title := _TITLE.match(text)):
        raise InputError(f"{path} has no title; begin its first line with # and a blank")
    opening, *headings_and_texts = _SECTION.split(text[title.end() :])
    pairs = zip(headings_and_texts[::2], headings_and_texts[1::2], strict=True)
    sections = [(f"{name}_{_key(heading)}", _plain(heading), show.convert(content)) for heading, content in pairs]
    introduction = show.convert(opening)
    return Part(title[1], show.findings, introduction, sections, show.answered, show.invitation, show.failures)


def source(path: Path, values: Mapping[str, Any], show: Html) -> str:
    """Return the Markdown of a template with its placeholders filled."""
    environment = templates(path.parent)
    environment.finalize = _shown
    environment.filters |= FILTERS
    calls = ("figure", "turnable", "embedded", "table", "folded", "fold", "finding", "answer", "invite", "failure")
    environment.globals |= WRITTEN | {call: getattr(show, call) for call in calls}
    if not path.is_file():
        raise InputError(f"{path} is missing: put the template back")
    try:
        return environment.get_template(path.name).render(values)
    except jinja2.TemplateSyntaxError as wrong:
        raise InputError(f"{path}, line {wrong.lineno}: {wrong.message}") from None
    except jinja2.UndefinedError as unknown:
        lines = [frame.lineno for frame in traceback.extract_tb(unknown.__traceback__) if frame.filename == str(path)]
        missing = str(unknown.message).removesuffix(" is undefined")
        raise InputError(f"{path}, line {lines[-1]}: there is no table or number called {missing}") from None


def _shown(value: Any) -> str:
    """Return a value as Markdown: a number as tables show it, a text with its special characters escaped."""
    if isinstance(value, _Text | jinja2.Undefined):
        return value  # type: ignore[return-value]
    return _SPECIAL.sub(r"\\\1", markup.text(value))


def _key(heading: str) -> str:
    return re.sub(r"\W+", "_", _plain(heading).lower()).strip("_")


def _plain(heading: str) -> str:
    """Return a heading without what escapes its special characters."""
    return re.sub(r"\\(?=\W)|\\(?=_)", "", heading).strip()


@cache
def _markdown() -> MarkdownIt:
    return MarkdownIt("commonmark", {"html": False}).enable("table")
