"""Models in motion, in the report: how wrong each is over a whole scene, what a second of it costs, and advice."""

from palpate.figures import tables
from palpate.report.material import Report
from palpate.report.parts.tradeoff import items

TITLE = "Models in motion"


def sections(report: Report) -> list[tuple[str, str, str]]:
    """The figure and its table, then the advice for each scene, if any was worked out."""
    found = report.tables["dynamic_accuracy"]
    shown = report.figure("dynamic_accuracy") + report.folded("dynamic_accuracy")
    advice = report.tables.get("advice")
    told = [] if advice is None else [(s, tables.where(advice, scene=s)) for s in tables.scenes(found)]
    advised = [(f"dynamic_{scene}", f"{scene.replace('_', ' ')}: what to take", items(rows)) for scene, rows in told]
    return [("dynamic_section", "Error over a scene against its cost", shown), *advised]
