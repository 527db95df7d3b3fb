"""Report how far palpate's values are from those that others published."""

from typing import Any

from palpate.report.report import Report

TITLE = "Checked from outside"
MET = 1e-9
"""Difference up to which a value is met to the digits that were published."""
KNOWN = 0.002
"""Difference up to which a value is met otherwise: published limits have errors of their own."""


def numbers(report: Report) -> dict[str, Any]:
    """Return what the template names."""
    table = report.tables["outside"].set_index("case")
    apart = table["difference"].abs()
    return {
        "values": len(table),
        "digits": int((apart < MET).sum()),
        "near": int(apart.between(MET, KNOWN).sum()),
        "known": KNOWN,
        "far": table[apart > KNOWN][["quantity", "difference"]].to_dict("records"),
        "bar": table.loc["bar_nodes", "difference"],
        "bar_limit": table.loc["bar_limit", "ours"],
        "bar_theirs": table.loc["bar_limit", "published"],
        "bar_error": table.loc["bar_limit", "own_error"],
        "plane": table.loc["cook_plane_strain", "ours"],
        "free": table.loc["cook_free", "ours"],
    }
