"""Check of the settings of palpation."""

from pathlib import Path

from palpate.errors import InputError, suggest


def check(config: dict, file: Path) -> None:
    """Raise InputError if no body has regions, or if a body that is named has none, or is not there."""
    bodies, named = config["bodies"], config["palpation"]["bodies"]
    able = [name for name, body in bodies.items() if body.get("regions")]
    if not able:
        raise InputError(f"{file}: palpation is there and no body has regions; give one some, or remove palpation.")
    for name in named or []:
        if name not in bodies:
            raise InputError(
                f"{file}: palpation.bodies names {name}, which is not there; {suggest(name, able, 'name')}"
            )
        if name not in able:
            raise InputError(
                f"{file}: palpation.bodies names {name}, which has no regions; {suggest(name, able, 'name')}"
            )
