"""Check of the scenes that the settings describe."""

from pathlib import Path

from palpate.errors import InputError
from palpate.files import check_file
from palpate.own_file import EFFECT_FUNCTIONS, check_source
from palpate.scenes.contact_settings import bodies_in, check_instruments
from palpate.scenes.effects_check import check_effects


def check(config: dict, file: Path) -> None:
    """Raise InputError for the first scene that names what is not there."""
    for name, scene in config["scenes"].items():
        place = f"{file}: scenes.{name}"
        _check_bodies(place, scene, config["bodies"])
        _check_effects(place, scene, config["bodies"][scene["body"]]["kind"])
        check_instruments(place, scene)
        _check_files(place, scene, file.parent)


def _check_bodies(place: str, scene: dict, bodies: dict) -> None:
    for body in bodies_in(scene):
        if body not in bodies:
            known = ", ".join(bodies) or "none"
            raise InputError(f"{place} names the body {body}, and bodies knows {known}; name one of them, or add it.")
        finest = bodies[body].get("refinements", 0)
        if scene["level"] > finest:
            raise InputError(f"{place}.level is {scene['level']}, and {body} has levels 0 to {finest}.")
        for key in ("young_pa", "poisson", "thickness_m"):
            of_first, of_this = (bodies[name].get(key, 0.0) for name in (scene["body"], body))
            if of_first != of_this:
                raise InputError(
                    f"{place}.others: {scene['body']} has {key} {of_first:g} and {body} {of_this:g}; "
                    "bodies of one scene must have the same stiffness and thickness: make them equal."
                )


def _check_effects(place: str, scene: dict, kind: str) -> None:
    if isinstance(scene["effects"], str) and scene["effects"] != "auto":
        raise InputError(f"{place}.effects is {scene['effects']!r}; write auto, or a list of names in brackets.")
    for name in scene.get("own_settings", {}):
        if name not in scene.get("own", {}):
            raise InputError(f"{place}.own_settings names {name}, and own does not; add its file there, or remove it.")
    check_effects(place, scene, kind)


def _check_files(place: str, scene: dict, folder: Path) -> None:
    tools = scene.get("contact", {}).get("instruments", [])
    files = {f"own.{name}": path for name, path in scene.get("own", {}).items()}
    files |= {f"contact.instruments[{i}].file": tool["file"] for i, tool in enumerate(tools) if "file" in tool}
    for name, path in files.items():
        check_file(f"{place}.{name}", path, (folder / path).is_file())
        if name.startswith("own."):
            check_source(f"{place}.{name}", folder / path, EFFECT_FUNCTIONS, "see docs/add-an-effect.md")
