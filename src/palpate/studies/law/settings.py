"""Settings of the study of the law."""

from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from palpate.benchmark.settings import Disc, check_refined, pressed_bodies
from palpate.bodies.material import LAWS
from palpate.bodies.settings import check_laws
from palpate.errors import InputError, describe_unknown
from palpate.setting_types import Count, Distinct, NotNegative, Positive, Some, key


class Settings(Disc):
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


def compared_bodies(config: Any) -> list[str]:
    """Return the names of the bodies that are pressed: those that are given or all that are refined, and regions_of."""
    return list(dict.fromkeys([*pressed_bodies(config, "law"), *config.law.regions_of]))


def changes_of(config: Any, body: str) -> Settings:
    """Return the settings of a body, without laws, ratios and contacts if only its regions are left out.

    These are the bodies that are named under regions_of alone; they are pressed at the contact above the regions.
    """
    if body in config.law.regions_of and body not in pressed_bodies(config, "law"):
        return config.law.model_copy(update={"laws": [], "poissons": [], "contacts": 0})
    return config.law


def check(config: Any, file: Path) -> None:
    """Raise InputError for laws that are unknown, bodies that cannot be pressed, and radii of bodies there are not."""
    place, names = f"{file}: law", compared_bodies(config)
    check_laws(f"{place}.laws", config.law.laws, file.parent)
    check_refined(f"{place}.bodies", names, config.bodies)
    for name in config.law.regions_of:
        if not config.bodies[name].regions:
            raise InputError(f"{place}.regions_of names {name}, which has no regions; give it some, or remove it.")
    if not names:
        raise InputError(f"{place} is there and no body is refined; give one refinements of at least 1.")
    if wrong := describe_unknown(list(config.law.radius_of_body_m), list(config.bodies)):
        raise InputError(f"{place}.radius_of_body_m names {wrong}")
