"""Settings of bodies from CT."""

from pathlib import Path
from typing import Annotated

from pydantic import Field

from palpate.bodies.settings import Ct
from palpate.errors import InputError
from palpate.setting_types import Block, Number, Some, Whole, key


class Imaging(Block):
    every: Some[Annotated[Whole, Field(ge=2)]] = key(
        "Distances, in slices, of those that a mask is drawn on", [2, 3, 5, 8, 10]
    )
    pixels: Whole = key("Pixels across the pictures that are made by ray casting, and timed", 160, ge=8)
    voxel_m: Number = key("Side of the synthetic scans' voxels [m]", 0.0025, ge=0.001, le=0.01)


class Settings(Block):
    """Masses of the nodes of bodies from CT, and the steps from a scan to a picture and a mask."""

    surface_nodes: Some[Annotated[Whole, Field(ge=12)]] = key(
        "Surface nodes of each mesh that is weighed", [140, 200, 300, 500, 800, 1200]
    )
    imaging: Imaging = key(
        "From a scan to a picture and a mask: synthetic CT and MRI of known truth (paper 3, chapter 2)", {}
    )


def check(config: dict, file: Path) -> None:
    """Raise InputError if no body is made from a CT."""
    if not any(isinstance(body, Ct) for body in config["bodies"].values()):
        raise InputError(f"{file}: ct is there and no body is of kind ct; add such a body, or remove ct.")
