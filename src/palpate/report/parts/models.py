"""The models in the report: what each family is, what it wants beforehand, and its knob."""

import pandas as pd

from palpate.report import markup
from palpate.report.material import Report

TITLE = "The models"
_OWN = {"what": "a model of your own", "before": "", "knob": ""}


def sections(report: Report) -> list[tuple[str, str, str]]:
    """One table: a row a family of which a model was measured, or an own model."""
    measured = report.tables["accuracy_vs_time"].groupby("model", sort=False)["knob"].nunique()
    rows, known = [], set()
    for family in report.published["models"]:
        names = [name for name in family["names"] if name in measured]
        known.update(names)
        if names:
            rows.append(_row(family["family"], family, measured[names]))
    rows += [_row(name, _OWN, measured[[name]]) for name in measured.index if name not in known]
    table = markup.table(pd.DataFrame(rows), "Models and their settings, as measured in all scenes together")
    return [("models_section", "What is compared", table)]


def _row(name: str, said: dict, settings: pd.Series) -> dict:
    """One family; of several models the most settings."""
    return {
        "model": name,
        "what it does": said["what"],
        "beforehand": said["before"],
        "knob": said["knob"],
        "forms": len(settings),
        "settings of each": int(settings.max()),
    }
