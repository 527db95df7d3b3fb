"""Gather what all parts of the report share: tables, published numbers, and captions filled with what was measured."""

from collections.abc import Collection, Mapping, Sequence
from copy import copy
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import MappingProxyType, ModuleType

from palpate.errors import InputError
from palpate.files import read_yaml
from palpate.report import markup, pictures, tables

CAPTIONS = Path(__file__).parent / "captions"
"""Captions that belong to no study."""
Section = tuple[str, str, str]
"""A section of a part: its identifier on the page, its heading, and its content as HTML."""


class Report:
    """Hold the material of the studies that are asked for; nothing else in ``results`` is read.

    scenes, cts, driven : names of the scenes that move, of the bodies from a CT, and of the scenes with an instrument
    last : the parts that belong to no study and come after those of the studies, by name
    more : names of the tables of this run that not every run of their studies makes
    It has ``tables`` by name, ``published`` with the numbers of each study's paper, ``parts`` with the modules of the
    page in order, and ``numbers`` with what the captions of each part name.
    """

    def __init__(
        self,
        results: str | Path,
        studies: Sequence[str],
        scenes: Sequence[str] = (),
        cts: Sequence[str] = (),
        driven: Collection[str] = (),
        last: Mapping[str, ModuleType] = MappingProxyType({}),
        more: Sequence[str] = (),
    ):
        self.scenes, self.cts, self.driven = scenes, cts, driven
        self.figures, self.part, self.folder = Path(results) / "figures", "", CAPTIONS
        self.studies = {study: part_of(study) for study in studies}
        self.tables = tables.read_all(Path(results) / "tables", {*tables_of(self.studies.values()), *more})
        published = {study: captions_of(part) / "published.yaml" for study, part in self.studies.items()}
        self.published = {study: read_yaml(path) for study, path in published.items() if path.is_file()}
        self.parts = self.studies | dict(last)
        self.numbers = {name: part.numbers(self.of(name)) for name, part in self.parts.items()}

    def of(self, part: str) -> "Report":
        """Return the same material as seen by one part: its captions and its numbers come first."""
        own = copy(self)
        own.part = part
        own.folder = captions_of(self.studies[part]) if part in self.studies else CAPTIONS
        return own

    def note(self, name: str, **more: str) -> str:
        """Fill a caption of the part; ``more`` holds what differs between its uses."""
        return markup.caption(self.folder, name, self.numbers.get(self.part, {}) | more)

    def figure(self, name: str, caption: str | None = None, small: str | None = None, **more: str) -> str:
        """Show a figure under the caption of its own name or of ``caption``; on narrow screens the figure ``small``."""
        return pictures.figure(self.figures, name, self.note(caption or name, **more), small)

    def picture(self, name: str, title: str, small: str | None = None) -> str:
        """Show a figure under a short title, where a caption for several figures stands before them."""
        return pictures.figure(self.figures, name, f"<p>{markup.escaped(title)}</p>", small)

    def turnable(self, name: str, title: str, caption: str = "") -> str:
        """Show a view that turns, under its title and a caption (HTML)."""
        return pictures.turnable(self.figures, name, title, caption)

    def folded(self, *names: str) -> str:
        """Show whole tables, closed at first, with what they hold."""
        about = {name: table for part in self.studies.values() for name, table in part.TABLES.items()}
        return "".join(markup.folded(self.tables[name], name, about[name].description) for name in names)

    def entries(self, name: str):
        """Read a YAML file that stands beside the part's captions."""
        return read_yaml(self.folder / f"{name}.yaml")

    def check(self, names: Collection[str], kind: str, wanted: Sequence[str]) -> None:
        """Raise InputError if one of the tables ``names`` has no rows of a scene or body in ``wanted``."""
        for name in names:
            for one in wanted:
                if one not in set(self.tables[name][kind]):
                    raise InputError(f"{name}.csv has no rows of the {kind} {one}; delete it and type make.")


def captions_of(part: ModuleType) -> Path:
    """Return the folder of the captions of a study, beside the module of its part."""
    return Path(str(part.__file__)).parent / "captions"


def part_of(study: str) -> ModuleType:
    """Import the part of the report about a study; InputError if there is none."""
    place = f"palpate.studies.{study}.report"
    if not find_spec(place):
        raise InputError(
            f"The report has no part about the study {study}; write src/palpate/studies/{study}/report.py with "
            "TITLE, TABLES, numbers and sections."
        )
    return import_module(place)


def tables_of(parts: Collection[ModuleType]) -> list[str]:
    """Name the tables that parts read: those that every run of their studies makes."""
    return [name for part in parts for name, table in part.TABLES.items() if table.always]
