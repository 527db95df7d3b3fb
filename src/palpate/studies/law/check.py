"""Check of the settings of the study of the law."""

from collections.abc import Sequence
from pathlib import Path

from palpate.bodies.material import LAWS
from palpate.errors import InputError, describe_unknown
from palpate.files import check_file
from palpate.own_file import LAW_FUNCTIONS, check_source


def compared_bodies(config: dict) -> list[str]:
    """Return the names of the bodies that are pressed: those that are given or all that are refined, and regions_of."""
    named = config["law"]["bodies"] or [name for name, body in config["bodies"].items() if body.get("refinements", 0)]
    return list(dict.fromkeys([*named, *config["law"]["regions_of"]]))


def changes_of(config: dict, body: str) -> dict:
    """Return what is tried of a body: ``laws``, ``poissons`` and the count of ``contacts``; regions are always tried.

    Of a body that is named under regions_of alone only these are left out, at the contact above them.
    """
    settings, alone = config["law"], body in config["law"]["regions_of"]
    alone &= body not in compared_bodies(config | {"law": settings | {"regions_of": []}})
    tried = {"laws": settings["laws"], "poissons": settings["poissons"], "contacts": settings["contacts"]}
    return {"laws": [], "poissons": [], "contacts": 0} if alone else tried


def check_laws(place: str, laws: Sequence[str], folder: Path) -> None:
    """Raise InputError for a law that is neither one of palpate's own nor a file of one, relative to ``folder``."""
    for law in laws:
        if not law.endswith(".py") and (wrong := describe_unknown([law], list(LAWS))):
            raise InputError(f"{place} names {wrong}")
        if law not in LAWS:
            check_file(place, law, (folder / law).is_file())
            check_source(place, folder / law, LAW_FUNCTIONS, "see docs/add-a-law.md")


def check(config: dict, file: Path) -> None:
    """Raise InputError for laws that are unknown, bodies that cannot be pressed, and radii of bodies there are not."""
    place, settings = f"{file}: law", config["law"]
    names = compared_bodies(config)
    check_laws(f"{place}.laws", settings["laws"], file.parent)
    if wrong := describe_unknown(names, list(config["bodies"])):
        raise InputError(f"{place}.bodies names {wrong}")
    for name in names:
        if not config["bodies"][name].get("refinements"):
            raise InputError(
                f"{place}.bodies names {name}, which is not refined; give it refinements of at least 1, "
                "so that its mesh has an error that can be seen."
            )
    for name in settings["regions_of"]:
        if not config["bodies"][name].get("regions"):
            raise InputError(f"{place}.regions_of names {name}, which has no regions; give it some, or remove it.")
    if not names:
        raise InputError(f"{place} is there and no body is refined; give one refinements of at least 1.")
    if wrong := describe_unknown(list(settings["radius_of_body_m"]), list(config["bodies"])):
        raise InputError(f"{place}.radius_of_body_m names {wrong}")
