"""Paper 3's experiments in the report: integrators, clusters, what shape matching costs, virtual body springs."""

from palpate.report.material import Report

TITLE = "Integrators, shape matching, springs"

SECTIONS = {
    "integrator_stability": "Integrators",
    "clusters": "Clusters",
    "shape_matching_timing": "Shape matching in time",
    "body_springs": "Virtual body springs",
}
"""Table, figure and caption of this name, and its heading."""


def sections(report: Report) -> list[tuple[str, str, str]]:
    """A figure and its folded table each."""
    return [(f"{name}_section", title, report.figure(name) + report.folded(name)) for name, title in SECTIONS.items()]
