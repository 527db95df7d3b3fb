"""Report on the scenes: how each moves, which effects act in it and why, and what they cost."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from palpate.report import markup, tables
from palpate.report.material import Report, Section
from palpate.report.number_format import percent, seconds
from palpate.report.words import capital, listed, spaced
from palpate.studies.scenes.measurements import FAILS, HOLDS, UNKNOWN
from palpate.studies.scenes.tables import TABLES

__all__ = ["TABLES", "TITLE", "numbers", "sections"]

TITLE = "Scenes in motion"


def numbers(report: Report) -> dict[str, str]:
    """Return every placeholder of the scenes' captions, as text; a phrase for each scene where there are several."""
    report.check([name for name, table in TABLES.items() if table.always], "scene", report.scenes)
    effects = report.tables["effects"]

    def phrases(phrase, table):
        return "; ".join(f"{spaced(scene)}: {phrase(tables.where(table, scene=scene))}" for scene in report.scenes)

    return {
        "headline": _headline(report.scenes, effects),
        "energy_balance": _balance(report.tables["energy_balance"], report.scenes),
        "costliest": phrases(_costliest, effects),
        "needed": phrases(lambda rows: _missed(rows, most=True), effects),
        "unneeded": phrases(lambda rows: _missed(rows, most=False), effects),
    }


def _headline(scenes, effects: pd.DataFrame) -> str:
    """Return what a step of each scene costs."""
    total = effects.groupby("scene")["ms_per_step"].sum()
    steps = ", ".join(f"{spaced(scene)} {seconds(1e-3 * total[scene])}" for scene in scenes)
    return (
        f"{len(scenes)} scenes, each computed from the effects that act in it and nothing else. A step takes: {steps}."
    )


def _balance(table: pd.DataFrame, scenes: Sequence[str]) -> str:
    """Return in which scenes no step gains energy, in which one does, and of which that is not known."""
    said, rows = [], table[table["scene"].isin(scenes)]
    for verdict, beginning in ((HOLDS, "This holds for"), (FAILS, "It does not hold for"), (UNKNOWN, "Not known of")):
        found = [
            spaced(row.scene) + (f" ({percent(row.gain_of_work)})" if verdict == FAILS else "")
            for row in rows[rows["verdict"] == verdict].itertuples()
        ]
        if found:
            why = ", whose elastic effect has no energy" if verdict == UNKNOWN else ""
            said.append(f"{beginning} {listed(found)}{why}.")
    return " ".join(said)


def _costliest(rows: pd.DataFrame) -> str:
    """Return what takes most of a step."""
    row = rows.loc[rows["ms_per_step"].idxmax()]
    total = seconds(1e-3 * rows["ms_per_step"].sum())
    return f"{spaced(row['effect'])} takes {percent(row['share_of_step'])} of {total}"


def _missed(rows: pd.DataFrame, most: bool) -> str:
    """Return the effect whose absence causes the largest, or the smallest, error."""
    found = rows[np.isfinite(rows["error_if_left_out"])]
    if found.empty:
        return "nothing can be left out"
    errors = found["error_if_left_out"]
    row = found.loc[errors.idxmax() if most else errors.idxmin()]
    return f"{spaced(row['effect'])} ({percent(row['error_if_left_out'])})"


def sections(report: Report) -> list[Section]:
    """Return all scenes, then their energies and the costs of their effects."""
    scenes = "".join(_scene(report, scene) for scene in report.scenes)
    costs = report.note("costs") + markup.fold("Every effect in every scene", report.figure("effects"))
    costs += report.folded("effects", "scene_effects")
    return [
        ("scenes_section", "The scenes", f'{report.note("animation")}\n<div class="cards">{scenes}</div>'),
        ("energies", "Energies", report.figure("energy") + report.folded("energy_balance", "energy")),
        ("costs", "What each effect costs", costs),
    ]


def _scene(report: Report, scene: str) -> str:
    """Show the motion of a scene to turn and play; folded, its stills, its effects and their costs."""
    title = capital(spaced(scene))
    inside = report.figure(f"motion_{scene}", "motion", scene=spaced(scene), raw=scene)
    if scene in report.driven:
        inside += report.figure(f"contact_force_{scene}", "contact_force", scene=spaced(scene))
    inside += _decisions(tables.where(report.tables["scene_effects"], scene=scene))
    inside += _cost(tables.where(report.tables["effects"], scene=scene))
    return (
        f'<section class="card" id="scene_{scene}">\n<h4>{markup.escaped(title)}</h4>\n'
        f"{report.turnable(f'motion_{scene}', title)}\n"
        f"{markup.fold('Moments, effects and their cost', inside)}\n</section>\n"
    )


def _decisions(rows: pd.DataFrame) -> str:
    """Tabulate which effects act, the others faint."""
    frame = pd.DataFrame(
        {
            "effect": rows["effect"].map(spaced),
            "acts": rows["called"].map({True: "yes", False: "no"}),
            "reason": rows["reason"],
        }
    )
    return markup.table(
        frame, "The effects that act, and why", [i for i, acts in enumerate(rows["called"]) if not acts]
    )


def _cost(rows: pd.DataFrame) -> str:
    """Tabulate what a step pays for, the most expensive first."""
    frame = rows.sort_values("ms_per_step", ascending=False, kind="stable")
    shown = pd.DataFrame(
        {
            "effect": frame["effect"].map(spaced),
            "time a step": [seconds(1e-3 * ms) for ms in frame["ms_per_step"]],
            "share of step": [percent(share) for share in frame["share_of_step"]],
            "memory [kB]": frame["memory_kb"],
            "error if left out": [percent(e) if e == e else None for e in frame["error_if_left_out"]],
        }
    )
    if "note" in frame and frame["note"].notna().any():
        shown["note"] = frame["note"].fillna("")
    return markup.table(shown, "What the effects cost, and the error without each (RMS / peak)")
