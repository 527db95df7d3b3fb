"""Gather what all parts of the report share: tables, published numbers, and what each study's module offers."""

from collections.abc import Collection, Sequence
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import Any

from palpate.errors import InputError
from palpate.files import read_yaml
from palpate.report import declared, tables
from palpate.report.template import Html, Part, render


class Report:
    """Hold the material of the studies that are asked for; nothing else in ``results`` is read.

    scenes, cts, driven : names of the scenes that move, of the bodies from a CT, and of the scenes with an instrument
    more : names of the tables of this run, of which those are read that a study describes
    It has ``tables`` by name, ``published`` with the numbers of each study's paper, and ``studies`` with the modules of
    their parts, in the order of the page.
    """

    def __init__(
        self,
        results: str | Path,
        studies: Sequence[str],
        scenes: Sequence[str] = (),
        cts: Sequence[str] = (),
        driven: Collection[str] = (),
        more: Sequence[str] = (),
    ):
        self.scenes, self.cts, self.driven = scenes, cts, driven
        self.figures = Path(results) / "figures"
        self.studies = {study: part_of(study) for study in studies}
        always = {name for study in studies for name, table in declared.tables(study).items() if table.always}
        described = {declared.CLAIMS.name}.union(*(declared.tables(study) for study in declared.names()))
        self.tables = tables.read_all(Path(results) / "tables", always | described.intersection(more))
        papers = {study: declared.folder(study) / "published.yaml" for study in studies}
        self.published = {study: read_yaml(path) for study, path in papers.items() if path.is_file()}

    def part(self, study: str, show: type[Html] = Html) -> Part:
        """Return the part of a study, from its template."""
        module, path = self.studies[study], declared.folder(study) / "report.md"
        return render(path, study, module.TITLE, self.values(study), show(self.figures, self.tables, declared.table))

    def values(self, study: str) -> dict[str, Any]:
        """Return what the template of a study names: ``numbers`` of its module, tables' names and published numbers."""
        return {"published": self.published.get(study, {})} | self.studies[study].numbers(self)

    def failures(self) -> list[tuple[str, str, str, str]]:
        """Return everything that failed: study, what, where, how."""
        parts = [part for part in self.studies.values() if hasattr(part, "failures")]
        return [(part.TITLE, *row) for part in parts for row in part.failures(self)]

    def check(self, names: Collection[str], kind: str, wanted: Sequence[str]) -> None:
        """Raise InputError if one of the tables ``names`` has no rows of a scene or body in ``wanted``."""
        for name in names:
            for one in wanted:
                if one not in set(self.tables[name][kind]):
                    raise InputError(f"{name}.csv has no rows of the {kind} {one}; delete it and type make.")


def part_of(study: str) -> ModuleType:
    """Import the part of the report about a study; InputError if there is none."""
    place = f"palpate.studies.{study}.report"
    if study not in declared.names() or not find_spec(place):
        raise InputError(
            f"The report has no part about the study {study}; write src/palpate/studies/{study}/report.py with "
            "TITLE and numbers, and report.md beside it."
        )
    return import_module(place)
