"""A result table: declared once, beside the function that computes its rows."""

from collections.abc import Iterable
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    import pandas as pd


class Table(NamedTuple):
    """Declare a table as a constant of a study's module, with literal arguments: they are read without an import.

    name : of results/tables/<name>.csv
    description : what it holds, in a sentence
    about : its columns in order, a line for those that share a meaning: "force_n torque_nm: load of a press [N, N m]";
        a line that continues the one before is indented by eight blanks
    always : whether every run of the study makes it
    """

    name: str
    description: str
    about: str
    always: bool = True

    @property
    def meanings(self) -> dict[str, str]:
        """The meaning of each group of columns."""
        lines = (line.partition(":") for line in self.about.replace(f"\n{8 * ' '}", " ").strip().splitlines())
        return {" ".join(names.split()): meaning.strip() for names, _, meaning in lines}

    @property
    def columns(self) -> list[str]:
        """The columns in the order of the file."""
        return " ".join(self.meanings).split()

    def frame(self, rows: Iterable) -> "pd.DataFrame":
        """Return rows (sequences or dicts) as a data frame with these columns."""
        import pandas as pd

        return pd.DataFrame(list(rows), columns=self.columns)
