"""Settings of the study of the law."""

from pathlib import Path
from typing import Annotated

from pydantic import Field

from palpate.benchmark.settings import pressed_bodies
from palpate.bodies.material import LAWS
from palpate.bodies.settings import check_laws
from palpate.errors import InputError, describe_unknown
from palpate.setting_types import Block, Count, Distinct, NotNegative, Positive, Some, key


class Settings(Block):
    """What the choice of the tissue's law changes, beside the error of the mesh: the same presses under each law."""

    bodies: Some[str] | None = key("Bodies that are pressed, by name; null takes all that are refined", None)
    regions_of: Distinct[str] = key("More bodies, of which only leaving out their regions is tried, near one", [])
    laws: Distinct[str] = key(
        "Laws that are compared with the one that each body has, by name, or as paths of Python files of your own, "
        "relative to the folder of the config file",
        list(LAWS),
    )
    poissons: Distinct[Annotated[NotNegative, Field(lt=0.5)]] = key(
        "Poisson's ratios that are compared with the body's own, under its own law and with its Young's modulus",
        [0.3, 0.49],
    )
    contacts: Count = key("Contacts of each body: half spread evenly over what can be pressed, half drawn by area", 2)
    depths: Distinct[Annotated[Positive, Field(le=0.5)]] = key(
        "Largest displacements of the presses at each contact, as shares of the body's longest side",
        [0.01, 0.1],
        min_length=2,
    )
    radius_m: Positive = key("Radius [m] of the disc that is pressed", 0.03)
    radius_of_body_m: dict[str, Positive] = key("Other radii [m], by the names of bodies", {})


def compared_bodies(config: dict) -> list[str]:
    """Return the names of the bodies that are pressed: those that are given or all that are refined, and regions_of."""
    return list(dict.fromkeys([*pressed_bodies(config, "law"), *config["law"]["regions_of"]]))


def changes_of(config: dict, body: str) -> dict:
    """Return what is tried of a body: ``laws``, ``poissons`` and the count of ``contacts``; regions are always tried.

    Of a body that is named under regions_of alone only these are left out, at the contact above them.
    """
    settings = config["law"]
    if body in settings["regions_of"] and body not in pressed_bodies(config, "law"):
        return {"laws": [], "poissons": [], "contacts": 0}
    return {key: settings[key] for key in ("laws", "poissons", "contacts")}


def check(config: dict, file: Path) -> None:
    """Raise InputError for laws that are unknown, bodies that cannot be pressed, and radii of bodies there are not."""
    place, settings = f"{file}: law", config["law"]
    names = compared_bodies(config)
    check_laws(f"{place}.laws", settings["laws"], file.parent)
    if wrong := describe_unknown(names, list(config["bodies"])):
        raise InputError(f"{place}.bodies names {wrong}")
    for name in names:
        if not config["bodies"][name].refinements:
            raise InputError(
                f"{place}.bodies names {name}, which is not refined; give it refinements of at least 1, "
                "so that its mesh has an error that can be seen."
            )
    for name in settings["regions_of"]:
        if not config["bodies"][name].regions:
            raise InputError(f"{place}.regions_of names {name}, which has no regions; give it some, or remove it.")
    if not names:
        raise InputError(f"{place} is there and no body is refined; give one refinements of at least 1.")
    if wrong := describe_unknown(list(settings["radius_of_body_m"]), list(config["bodies"])):
        raise InputError(f"{place}.radius_of_body_m names {wrong}")
