"""Describe the result tables; each study declares its own in ``palpate.studies.<study>.tables``."""

from importlib import import_module
from importlib.util import find_spec
from pkgutil import iter_modules
from typing import NamedTuple

from palpate import studies


class Table(NamedTuple):
    """Describe a result table: the columns that are read from it, and in one sentence what it holds.

    columns : separated by blanks; the file may have more
    always : whether every run of the study makes it
    """

    columns: str
    description: str
    always: bool = True


SHARED = {
    "claims": Table(
        "paper section claim premise published ours verdict study",
        "Each claim of the three papers, the premise that it was tested in, what was published and what this run "
        "measured, the verdict, and the study whose tables it follows from.",
    )
}
"""Tables that no single study makes."""


def declared(study: str) -> dict[str, Table]:
    """Return the tables that a study declares; none if it declares none."""
    place = f"{studies.__name__}.{study}.tables"
    return import_module(place).TABLES if find_spec(place) else {}


def find(name: str) -> Table:
    """Find the table of that name in whatever study; KeyError if no study declares it."""
    if name in SHARED:
        return SHARED[name]
    for study in (module.name for module in iter_modules(studies.__path__) if module.ispkg):
        if name in declared(study):
            return declared(study)[name]
    raise KeyError(f"no study declares a table {name} in palpate/studies/<study>/tables.py")


def columns(name: str) -> list[str]:
    """Return the columns that are read from the table of that name."""
    return find(name).columns.split()
