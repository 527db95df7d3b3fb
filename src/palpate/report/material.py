"""What all sections of the report share: tables, the papers' own numbers, and captions filled with ours."""

from collections.abc import Collection, Iterable
from itertools import product
from pathlib import Path

import pandas as pd

from palpate.errors import InputError
from palpate.evaluation.table import declared
from palpate.figures import tables
from palpate.files import read_yaml
from palpate.report import markup, pictures
from palpate.report.numbers import numbers


def _tables(study: str) -> list[str]:
    """The tables that every run of a study makes."""
    return [name for name, table in declared(study).items() if table.always]


TABLES = {
    "models": ["accuracy_vs_time"],
    "tradeoff": _tables("tradeoff"),
    "dynamic": _tables("dynamic"),
    "ct": _tables("ct"),
    "scenes": _tables("scenes"),
    "soft_bodies": _tables("shape_matching"),
    "collision": _tables("collision"),
    "springs": _tables("springs"),
    "enrichment": _tables("enrichment"),
    "scaling": _tables("scaling"),
    "hard_cases": _tables("hard_cases"),
}
"""The tables that each part of the report shows; parts that are not here look at those of the others."""

PUBLISHED = {
    "models": "models.yaml",
    "soft_bodies": "soft_bodies.yaml",
    "collision": "soft_bodies.yaml",
    "springs": "springs.yaml",
    "enrichment": "paper.yaml",
}
"""Where a part's own paper has its numbers, or its models their descriptions, beside the captions."""


class Report:
    """The material of the ``parts`` that are asked for; nothing else in ``results`` is looked at."""

    def __init__(
        self,
        results: Path,
        captions: Path,
        parts: list[str],
        scenes: list[str],
        cts: list[str],
        driven: Collection[str],
    ):
        self.scenes, self.cts, self.driven = scenes, cts, driven
        self.figures, self._captions = results / "figures", captions
        self.published = {part: read_yaml(captions / PUBLISHED[part]) for part in parts if part in PUBLISHED}
        self.tables = tables.read_all(results / "tables", [name for part in parts for name in TABLES.get(part, ())])
        _check(self.tables, _tables("scenes") if scenes else [], "scene", scenes)
        _check(self.tables, _tables("ct") if cts else [], "body", cts)
        self.numbers = numbers(self.tables, self.published, parts, scenes)

    def note(self, name: str, **more: str) -> str:
        """A caption by name; ``more`` holds what differs between its uses."""
        return markup.caption(self._captions, name, self.numbers | more)

    def figure(self, name: str, caption: str | None = None, **more: str) -> str:
        """A figure under the caption of its own name or of ``caption``."""
        return pictures.figure(self.figures, name, self.note(caption or name, **more))

    def turnable(self, name: str, title: str, caption: str, **more: str) -> str:
        """A view that turns, under its title and a caption."""
        return pictures.turnable(self.figures, name, title, self.note(caption, **more))

    def folded(self, *names: str) -> str:
        """Whole tables, closed at first."""
        return "".join(markup.folded(self.tables[name], name) for name in names)


def _check(found: dict[str, pd.DataFrame], names: Iterable[str], kind: str, wanted: list[str]) -> None:
    """Raise InputError if a table of the scenes, or of the bodies from CT, lacks one of them."""
    for name, one in product(names, wanted):
        if one not in set(found[name][kind]):
            raise InputError(f"{name}.csv has no rows of the {kind} {one}: delete it and make it again")
