"""Check of the settings of paper 3's experiments."""

from pathlib import Path

from palpate.errors import InputError, describe_unknown

NEEDED = ("springs", "push", "maxwell")


def check(config: dict, file: Path) -> None:
    """Raise InputError if the scene that creeps is unknown, or has no springs with Maxwell dampers under a load."""
    creep, scenes = config["shape_matching"]["creep"], config.get("scenes", {})
    if creep is None:
        return
    if wrong := describe_unknown([creep["scene"]], list(scenes)):
        raise InputError(f"{file}: shape_matching.creep.scene names {wrong}")
    named = scenes[creep["scene"]].get("effects", "auto")
    missing = [name for name in NEEDED if name not in (scenes[creep["scene"]] if named == "auto" else named)]
    if missing:
        raise InputError(
            f"{file}: shape_matching.creep.scene names {creep['scene']}, which lacks {', '.join(missing)}; name a "
            "scene of springs with maxwell that a push loads, or write creep: null."
        )
