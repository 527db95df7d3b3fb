"""The scenes in the report: how each moves, which effects it calls for and why, and what they cost."""

from palpate.figures import tables
from palpate.figures.number_format import percent, seconds
from palpate.report import markup
from palpate.report.material import Report

TITLE = "Scenes"


def sections(report: Report) -> list[tuple[str, str, str]]:
    """One section a scene, then energies and costs of all of them."""
    return [
        *((f"scene_{scene}", scene.replace("_", " "), _scene(report, scene)) for scene in report.scenes),
        ("energies", "Energies", report.figure("energy") + report.folded("energy")),
        ("costs", "What each effect costs", _costs(report)),
    ]


def _scene(report: Report, scene: str) -> str:
    """The motion to turn and play, stills, decisions and costs of one scene."""
    return (
        report.turnable(f"motion_{scene}", scene.replace("_", " "), "animation", scene=scene)
        + report.figure(f"motion_{scene}", "motion", scene=scene)
        + (report.figure(f"contact_force_{scene}", "contact_force", scene=scene) if scene in report.driven else "")
        + _decisions(tables.where(report.tables["scene_effects"], scene=scene), scene)
        + _cost(tables.where(report.tables["effects"], scene=scene), scene)
    )


def _decisions(rows, scene) -> str:
    """Which effects are called, the others faint."""
    frame = rows.drop(columns="scene")
    for column in frame.select_dtypes("bool"):
        frame[column] = frame[column].map({True: "yes", False: "no"})
    faint = [i for i, called in enumerate(rows["called"]) if not called]
    return markup.table(frame, f"{scene}: the effects that it calls for, and why", faint)


def _cost(rows, scene) -> str:
    """What a step pays for, the dearest first."""
    frame = rows.sort_values("ms_per_step", ascending=False, kind="stable")
    told = frame[["effect"]].assign(
        time_a_step=[seconds(1e-3 * ms) for ms in frame["ms_per_step"]],
        share_of_step=[percent(share) for share in frame["share_of_step"]],
        memory_kb=frame["memory_kb"],
        error_if_left_out=[percent(e) if e == e else None for e in frame["error_if_left_out"]],
    )
    if "note" in frame and frame["note"].notna().any():
        told["note"] = frame["note"].fillna("")
    return markup.table(told, f"{scene}: what its effects cost, and how wrong it gets without each (rms / peak)")


def _costs(report: Report) -> str:
    return report.figure("effects") + report.folded("effects", "scene_effects")
