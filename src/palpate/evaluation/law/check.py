"""Check of the settings of the study of the law."""

from pathlib import Path

from palpate.bodies.material import LAWS
from palpate.errors import InputError, describe_unknown
from palpate.files import check_file
from palpate.own_file import LAW_FUNCTIONS, check_source


def compared_bodies(config: dict) -> list[str]:
    """Return the names of the bodies that are pressed under each law: those that are given, or all that are refined."""
    return config["law"]["bodies"] or [name for name, body in config["bodies"].items() if body.get("refinements", 0)]


def check(config: dict, file: Path) -> None:
    """Raise InputError for laws that are unknown, bodies that cannot be pressed, and radii of bodies there are not."""
    place, settings = f"{file}: law", config["law"]
    names = compared_bodies(config)
    for law in settings["laws"]:
        if not law.endswith(".py") and (wrong := describe_unknown([law], list(LAWS))):
            raise InputError(f"{place}.laws names {wrong}")
        if law not in LAWS:
            check_file(f"{place}.laws", law, (file.parent / law).is_file())
            check_source(f"{place}.laws", file.parent / law, LAW_FUNCTIONS, "see docs/add-a-law.md")
    if wrong := describe_unknown(names, list(config["bodies"])):
        raise InputError(f"{place}.bodies names {wrong}")
    for name in names:
        if not config["bodies"][name].get("refinements"):
            raise InputError(
                f"{place}.bodies names {name}, which is not refined; give it refinements of at least 1, "
                "so that its mesh has an error that can be seen."
            )
    if not names:
        raise InputError(f"{place} is there and no body is refined; give one refinements of at least 1.")
    if wrong := describe_unknown(list(settings["radius_of_body_m"]), list(config["bodies"])):
        raise InputError(f"{place}.radius_of_body_m names {wrong}")
