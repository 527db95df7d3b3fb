"""Settings of palpation."""

from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from palpate.errors import InputError, suggest
from palpate.setting_types import Block, Positive, Some, Whole, key

Pressure = Annotated[Positive, Field(le=0.3)]


class Settings(Block):
    """Whether a finger feels the regions of bodies, such as a tumour, and how deep they may lie."""

    bodies: Some[str] | None = key("Which of the bodies are pressed; null for all that have regions", None)
    places: Whole = key("Places of each body that are pressed, from the nearest to a region to far ones", 8, ge=2)
    radius_m: Positive = key("Radius [m] of the finger's patch", 0.012)
    pressures_of_young: Some[Pressure] = key(
        "Peak pressures 2 F/(π R²) of each press, as shares of the body's own Young's modulus; a thin lobe snaps "
        "beyond 0.15",
        [0.03, 0.06, 0.09, 0.12],
    )
    covers_m: Some[Positive] = key("Depths [m] of the ball's top below the slab's", [0.004, 0.008, 0.012, 0.016])
    contrasts: Some[Positive] = key("Young's moduli of the ball, relative to that of the slab", [2, 5, 10, 100, 10000])


def check(config: Any, file: Path) -> None:
    """Raise InputError if no body has regions, or if a body that is named has none, or is not there."""
    bodies, named = config.bodies, config.palpation.bodies
    possible = [name for name, body in bodies.items() if getattr(body, "regions", None)]
    if not possible:
        raise InputError(f"{file}: palpation is there and no body has regions; give one some, or remove palpation.")
    for name in named or []:
        if name not in possible:
            lack = "has no regions" if name in bodies else "is not there"
            raise InputError(f"{file}: palpation.bodies names {name}, which {lack}; {suggest(name, possible, 'name')}")
