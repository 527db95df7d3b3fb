"""A scene: which bodies move, what acts on them, and how time is stepped. Its effects are its blocks."""

import json
from typing import Annotated, Any, Literal

from pydantic import AfterValidator
from pydantic_core import PydanticCustomError

from palpate.bodies.cutting.settings import Cut
from palpate.effects.settings import (
    Bending,
    BodySprings,
    Hook,
    Kelvin,
    Loads,
    Maxwell,
    Other,
    Prony,
    Rayleigh,
    ShapeMatching,
    Springs,
    Stepping,
    Thread,
    VelocityDamping,
    Volume,
)  # fmt: skip
from palpate.setting_types import Index, Name, Switch, key, optional


def _finite(settings: dict[str, dict[str, Any]]) -> dict[str, dict[str, Any]]:
    try:
        json.dumps(settings, allow_nan=False, default=str)
    except ValueError:
        raise PydanticCustomError("finite", "give finite numbers") from None
    return settings


class Scene(Loads, Stepping):
    """What moves and what acts on it: finite elements of the body's law, unless springs or shape matching are there."""

    body: str = key("Which of the bodies")
    level: Index = key("Which of the body's nested meshes, 0 is the coarse one", 0)
    surface: Switch = key("Whether to move the surface only and not the inside", False)
    held: Switch = key("Whether the body's anchors and its bed hold it", True)
    others: list[Other] = key("More bodies; with finite elements of any materials, else of the same stiffness", [])
    start: Literal["rest", "inverted", "random", "plane", "line", "point"] = key("Where it begins", "rest")
    hooks: list[Hook] | None = optional("Patches that are grasped and moved or pulled, and let go", min_length=1)
    threads: list[Thread] | None = optional("Sutures that are tied, tightened, and pull", min_length=1)
    cut: Cut | None = optional("A blade that severs the scene's own body while it moves")
    springs: Springs | None = optional("Springs in place of finite elements")
    shape_matching: ShapeMatching | None = optional("Goal positions from the rest shape, in place of finite elements")
    bending: Bending | None = optional("A sheet's resistance to bending")
    volume: Volume | None = optional("Volume preservation of springs, whose Poisson's ratio is 1/4 without it")
    body_springs: BodySprings | None = optional("Springs and dampers to the rest position")
    prony: Prony | None = optional(
        "Shear stress that relaxes, beside finite elements, whose Young's modulus is that at the end"
    )
    rayleigh: Rayleigh | None = optional("Damping in proportion to mass and stiffness")
    kelvin: Kelvin | None = optional("Dampers beside the springs")
    maxwell: Maxwell | None = optional("Springs that relax, beside the springs")
    velocity_damping: VelocityDamping | None = optional("Damping in proportion to velocity")
    own: dict[Name, str] = key("Effects of your own: name and Python file, relative to this configuration", {})
    own_settings: Annotated[dict[str, dict[str, Any]], AfterValidator(_finite)] = key(
        "What your effects get as settings, by name", {}
    )
    name: Name = key("What messages and tables call it; in a configuration its key", "scene")
    seed: Index = key("Of the start random; in a configuration its seed", 1)

    @property
    def bodies(self) -> list[str]:
        """The names of all bodies, its own first."""
        return [self.body, *(other.body for other in self.others)]

    @property
    def place(self) -> str:
        """The name in messages."""
        return f"scenes.{self.name}"
