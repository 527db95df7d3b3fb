"""Let a reader press the bodies, and say what answers."""

import numpy as np
import pandas as pd

from palpate.files import require_file
from palpate.press.page.page import TITLES
from palpate.press.portable.file import FOUR_ERRORS
from palpate.report import markup, tables
from palpate.report.material import Report, Section
from palpate.report.number_format import each, percent, seconds
from palpate.report.words import capital, spaced
from palpate.studies.press.tables import TABLES

__all__ = ["TABLES", "TITLE", "numbers", "sections"]

TITLE = "Press it"


def numbers(report: Report) -> dict[str, str]:
    """Return every placeholder of these captions, as text."""
    table = tables.where(report.tables["press"], model="contact_modes")
    bodies = tables.bodies(table)
    said = each(bodies, lambda body: _worth(tables.where(table, body=body).iloc[0]))
    return {
        "headline": f"Press {' or '.join(spaced(body) for body in bodies)} in this page; contact modes answer: {said}.",
        "press_worth": said,
        "press_errors": " ".join(FOUR_ERRORS),
        "press_contacts": each(bodies, lambda body: str(tables.where(table, body=body)["contacts"].iloc[0])),
        "press_doubted": each(bodies, lambda body: _doubted(tables.where(report.tables["press"], body=body))),
    }


def _worth(row: pd.Series) -> str:
    """Return the error, where it is known, and the time of the model."""
    time = f"{seconds(row['online_median_s'])} in Python"
    return f"{percent(row['rmse_of_peak'])} of the peak wrong, in {time}" if row["samples"] else time


def _doubted(rows: pd.DataFrame) -> str:
    """Return how many of the presses contact modes doubt."""
    row = rows[rows["model"] == "contact_modes"].iloc[0]
    return f"{row['doubted']:.0f} of {max(row['samples'], 1):.0f}" if row["samples"] else "none known"


def sections(report: Report) -> list[Section]:
    """Return a section to press each body."""
    table = report.tables["press"]
    found = []
    for body in tables.bodies(table):
        page = require_file(report.figures / f"press_{body}.section").read_text(encoding="utf-8")
        rows = tables.where(table, body=body)
        shown = pd.DataFrame(
            {
                "model": [TITLES[name] for name in rows["model"]],
                "RMSE, median [% of peak]": 100 * rows["rmse_of_peak"],
                "RMSE, most [% of peak]": 100 * rows["rmse_of_peak_most"],
                "RMSE by its own estimate [% of peak]": 100 * rows["error_of_peak"],
                "time in Python, median [ms]": 1e3 * rows["online_median_s"],
                "file [MB]": rows["file_mb"],
            }
        ).replace({np.nan: None})
        known = int(rows["samples"].iloc[0])
        what = f"on {known} presses whose truth was simulated" if known else "without a truth to compare with"
        found.append(
            (f"press_{body}_section", capital(spaced(body)), page + markup.table(shown, f"The models above, {what}"))
        )
    key, title, content = found[-1]
    return [*found[:-1], (key, title, content + report.note("press") + report.folded("press"))]
