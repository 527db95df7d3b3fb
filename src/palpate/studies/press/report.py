"""Let a reader press the bodies, and say what answers."""

from typing import Any

import numpy as np
import pandas as pd

from palpate.press.page.page import TITLES
from palpate.press.portable.file import FOUR_ERRORS
from palpate.report import tables
from palpate.report.report import Report
from palpate.report.words import spaced

TITLE = "Press it"


def numbers(report: Report) -> dict[str, Any]:
    """Return what the template names: of each body how wrong contact modes are, and all models that answer."""
    table = report.tables["press"]
    return {
        "bodies": [_body(body, tables.where(table, body=body)) for body in tables.bodies(table)],
        "errors": FOUR_ERRORS,
    }


def _body(body: str, rows: pd.DataFrame) -> dict[str, Any]:
    modes = tables.where(rows, model="contact_modes").iloc[0]
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
    told = ["contacts", "samples", "rmse_of_peak", "error_of_peak", "online_median_s", "doubted"]
    return {"key": body, "name": spaced(body), "models": shown} | modes[told].to_dict()
