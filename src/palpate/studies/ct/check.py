"""Check of the settings of bodies from CT."""

from pathlib import Path

from palpate.errors import InputError


def check(config: dict, file: Path) -> None:
    """Raise InputError if no body is made from a CT."""
    if not any(body["kind"] == "ct" for body in config["bodies"].values()):
        raise InputError(f"{file}: ct is there and no body is of kind ct; add such a body, or remove ct.")
