"""Checks of the block ``scenes`` that its schema cannot make; a scene's fields are in palpate.scenes.settings."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from palpate.bodies.settings import Body
from palpate.effects.settings import Triangles
from palpate.errors import InputError, suggest
from palpate.files import check_file
from palpate.own_file import EFFECT_FUNCTIONS, check_source
from palpate.scenes.scene_check import check_effects, check_instruments, check_loads
from palpate.scenes.settings import Scene
from palpate.setting_types import Name

Settings = Annotated[dict[Name, Scene], Field(min_length=1, description="What is simulated over time, by name")]


def check(config: Any, file: Path) -> None:
    """Raise InputError for the first fault of a scene: an unknown body, unsuitable effect, wrong path, load or file."""
    for name, scene in config.scenes.items():
        place = f"{file}: scenes.{name}"
        if idle := scene.model_fields_set & {"name", "seed"}:  # those of scenes made in Python
            raise InputError(
                f"{place}.{min(idle)} has no use: a scene has its key's name and the run's seed; remove it."
            )
        _check_bodies(place, scene, config.bodies)
        _check_effects(place, scene, config.bodies)
        check_instruments(place, scene)
        check_loads(place, scene)
        _check_files(place, scene, file.parent)


def _check_bodies(place: str, scene: Scene, bodies: Mapping[str, Body]) -> None:
    for body in scene.bodies:
        if body not in bodies:
            remedy = suggest(body, list(bodies), "add it there, or name") if bodies else "add it there."
            raise InputError(f"{place} names the body {body}, which is not under bodies; {remedy}")
        finest = bodies[body].refinements
        if scene.level > finest:
            raise InputError(f"{place}.level is {scene.level}, and {body} has levels 0 to {finest}.")


def _check_effects(place: str, scene: Scene, bodies: Mapping[str, Body]) -> None:
    for name in scene.own_settings:
        if name not in scene.own:
            raise InputError(f"{place}.own_settings names {name}, and own does not; add its file there, or remove it.")
    check_effects(place, scene, bodies)


def _check_files(place: str, scene: Scene, folder: Path) -> None:
    """Raise InputError for files of own effects and of instruments that are missing or not as they must be."""
    files = {f"own.{name}": path for name, path in scene.own.items()}
    for i, tool in enumerate(scene.instruments):
        if isinstance(tool, Triangles):
            files[f"contact.instruments[{i}].file"] = tool.file
    for name, path in files.items():
        check_file(f"{place}.{name}", path, (folder / path).is_file())
        if name.startswith("own."):
            check_source(f"{place}.{name}", folder / path, EFFECT_FUNCTIONS, "see docs/add-an-effect.md")
