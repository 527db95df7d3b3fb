"""Compare models in motion: the error of each over a whole scene, what a second of it costs, and what to take."""

from collections.abc import Iterator

import pandas as pd

from palpate.report import markup, tables
from palpate.report.material import Report, Section
from palpate.report.model_looks import label, look
from palpate.report.number_format import percent
from palpate.report.words import listed, spaced
from palpate.studies.dynamic.mesh_error import MeshError, mesh_error
from palpate.studies.dynamic.tables import TABLES
from palpate.studies.tradeoff.motion_words import brief, sentence
from palpate.studies.tradeoff.report import by_limit, items

__all__ = ["TABLES", "TITLE", "failures", "numbers", "sections"]

TITLE = "Models in motion"
TAKEN = "What to take, its error, below what that stays where the push is elsewhere, and its speed"


def numbers(report: Report) -> dict[str, str]:
    """Return every placeholder of these captions, as text."""
    table = report.tables["dynamic_accuracy"]
    best = [_most_accurate(scene, tables.where(table, scene=scene)) for scene in tables.scenes(table)]
    return {
        "headline": f"The most accurate models that run in real time: {'; '.join(best)}.",
        "reference_levels": _levels(table),
        "mesh_errors": _meshes(report),
        "unresolved": _unresolved(table),
        "bound_places": str(_places(report)),
        "unbounded": _unbounded(report),
        "bound_scenes": _bounded_scenes(report),
    }


def _most_accurate(scene: str, rows: pd.DataFrame) -> str:
    """Name the model with the least error of those that need less than a second for a second of motion."""
    fast = rows[(rows["failures"] == 0) & (rows["real_time_factor"] < 1)]
    if fast.empty:
        return f"{spaced(scene)}: none"
    best = fast.loc[fast["rmse_of_peak"].idxmin()]
    return f"{spaced(scene)}: {look(best['model']).label} (error {percent(best['rmse_of_peak'])})"


def _levels(table: pd.DataFrame) -> str:
    """Name the level of the reference of each scene."""
    first = table.drop_duplicates("scene")
    return ", ".join(f"{spaced(row.scene)} {row.reference_level:g}" for row in first.itertuples())


def _meshes(report: Report) -> str:
    """Return how wrong the mesh of each standard is itself, where presses of its body have a truth."""
    first = report.tables["dynamic_accuracy"].drop_duplicates("scene")
    pressed = report.tables.get("accuracy_vs_time")
    known: dict[tuple[str, int, MeshError], list[str]] = {}
    unknown = []
    for row in first.itertuples():
        found = mesh_error(pressed, str(row.body), int(row.reference_level))
        if found is None:
            unknown.append(spaced(row.scene))
        else:
            known.setdefault((str(row.body), int(row.reference_level), found), []).append(spaced(row.scene))
    parts = [
        f"of {' and '.join(names)} ({body}, level {level}) {percent(error.low)} to {percent(error.high)} of the peak, "
        f"at the patch {percent(error.patch_low)} to {percent(error.patch_high)}, in presses whose truth is known"
        for (body, level, error), names in known.items()
    ]
    if unknown:
        parts.append(f"not known of {', '.join(unknown)}")
    return "; ".join(parts)


def _unresolved(table: pd.DataFrame) -> str:
    """Name the scenes that are compared in a part only, as steps are not resolved later."""
    first = table.drop_duplicates("scene")
    cut = first[first["resolved_s"] < first["duration_s"] * (1 - 1e-9)]
    if cut.empty:
        return "Every scene is resolved to its end."
    parts = [
        f"{spaced(row.scene)} in its first {row.resolved_s:.2g} s of {row.duration_s:.2g} s" for row in cut.itertuples()
    ]
    return f"Not resolved to the end, and compared in a part only: {'; '.join(parts)}."


def sections(report: Report) -> list[Section]:
    """Return the figure and its table, how far references are resolved, then the advice."""
    found, advice = report.tables["dynamic_accuracy"], report.tables["advice"]
    shown = report.figure("dynamic_accuracy") + report.folded("dynamic_accuracy")
    resolved = report.figure("dynamic_reference") + report.folded("dynamic_reference")
    names = {scene: spaced(scene) for scene in tables.scenes(found)}
    moving = advice[advice["scene"].isin(names)]
    words = "".join(
        f"<h4>{markup.escaped(name)}</h4>{items(tables.where(moving, scene=s), sentence)}" for s, name in names.items()
    )
    overview = by_limit(moving, names, TAKEN, brief)
    taken = report.note("dynamic_advice") + overview + markup.fold("The same in words", words)
    return [
        ("dynamic_section", "Error over a scene against its cost", shown),
        ("dynamic_resolved", "How far the references are resolved", resolved),
        *([("dynamic_bounds", "How wrong a motion may be elsewhere", _bounds(report))] if _places(report) else []),
        ("dynamic_advice", "What to take", taken),
    ]


def _places(report: Report) -> int:
    """Return at how many other places a push was measured, 0 if at none."""
    bounds = report.tables.get("motion_bounds")
    return 0 if bounds is None else int(bounds["places"].max())


def _bounded_scenes(report: Report) -> str:
    """Name the scenes whose push was moved."""
    bounds = report.tables.get("motion_bounds")
    return "" if bounds is None else listed([spaced(scene) for scene in tables.scenes(bounds)])


def _unbounded(report: Report) -> str:
    """Name the scenes whose push was not moved, so that they have no bounds."""
    bounds = report.tables.get("motion_bounds")
    known = set() if bounds is None else set(bounds["scene"])
    rest = [spaced(scene) for scene in tables.scenes(report.tables["dynamic_accuracy"]) if scene not in known]
    return f"the own motion alone was measured of {listed(rest)}." if rest else "every scene has it."


def _bounds(report: Report) -> str:
    """Show the bounds of motions elsewhere, by what each setting's error is known best."""
    found = report.tables["motion_bounds"]
    rows = pd.DataFrame(
        {
            "scene": [spaced(scene) for scene in found["scene"]],
            "model": [label(row.model, row.setting) for row in found.itertuples()],
            "estimated from": found["estimate"].map({"constant": "nothing", "own": "its own motion"}),
            "places": found["places"],
            "error, median [% of peak]": 100 * found["error_of_peak"],
            "bound, median [% of peak]": 100 * found["bound_of_peak"],
            "bound over error": found["sharpness"],
            "rank correlation": found["rank_correlation"],
            "places below their bound [%]": 100 * found["coverage"],
        }
    )
    return report.note("motion_bounds") + markup.table(rows, "90 % bounds of a motion whose push is elsewhere")


def failures(report: Report) -> Iterator[tuple[str, str, str]]:
    """Yield the settings that did not get through a scene: what, where, how."""
    table = report.tables["dynamic_accuracy"]
    for row in table[table["failures"] > 0].itertuples():
        yield label(row.model, row.setting), spaced(row.scene), "did not reach the end"
