"""Gather what all parts of the report share: tables, published numbers, and what each study adds to them."""

from collections.abc import Collection, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from palpate.errors import InputError
from palpate.files import read_yaml
from palpate.report import declared, tables
from palpate.report.template import Html, Part, render


class Report:
    """Hold the material of the studies that are asked for; nothing else in ``results`` is read.

    scenes, cts, driven : names of the scenes that move, of the bodies from a CT, and of the scenes with an instrument
    more : names of the tables of this run, of which those are read that a study describes
    It has ``tables`` by name, ``published`` with the numbers of each study's paper, and ``studies`` in the order of the
    page. Raises InputError if a study has no template.
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
        self.studies = studies
        for study in studies:
            if study not in declared.names() or not (declared.folder(study) / "report.md").is_file():
                raise InputError(
                    f"The report has no part about the study {study}; write src/palpate/studies/{study}/report.md."
                )
        always = {name for study in studies for name, table in declared.tables(study).items() if table.always}
        described = {declared.CLAIMS.name}.union(*(declared.tables(study) for study in declared.names()))
        self.tables = tables.read_all(Path(results) / "tables", always | described.intersection(more))
        papers = {study: declared.folder(study) / "published.yaml" for study in studies}
        self.published = {study: read_yaml(path) for study, path in papers.items() if path.is_file()}

    def part(self, study: str, show: type[Html] = Html) -> Part:
        """Return the part of a study, from its template."""
        html = show(self.figures, self.tables, declared.table)
        return render(declared.folder(study) / "report.md", study, self.values(study), html)

    def values(self, study: str) -> dict[str, Any]:
        """Return what the template of a study names: its tables, what was published, ``numbers`` of its report.py."""
        tables_of_study = {name: self.tables[name] for name in declared.tables(study) if name in self.tables}
        values = {"published": self.published.get(study, {})} | tables_of_study
        if not (declared.folder(study) / "report.py").is_file():
            return values
        return values | import_module(f"{declared.STUDIES}.{study}.report").numbers(self)

    def check(self, names: Collection[str], kind: str, wanted: Sequence[str]) -> None:
        """Raise InputError if one of the tables ``names`` has no rows of a scene or body in ``wanted``."""
        for name in names:
            for entry in wanted:
                if entry not in set(self.tables[name][kind]):
                    raise InputError(f"{name}.csv has no rows of the {kind} {entry}; delete it and type make.")
