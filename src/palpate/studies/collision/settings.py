"""Settings of the comparison of bounding structures."""

from typing import Annotated

from pydantic import Field

from palpate.setting_types import Block, Count, Index, Pair, Positive, Whole, key


class Stopped(Block):
    frames: Count = key("Frames of each scene", 20)
    layers: list[Index] = key(
        "Layers at which trees are stopped, the root being 0; one beyond the height of a tree keeps all of it",
        [0, 2, 4, 6, 8, 10, 16],
        min_length=1,
    )
    depths: list[Pair[Index]] = key("Composite trees that are stopped, as above", [[2, 2], [4, 4]])


class Apart(Block):
    gaps_m: list[Positive] = key("Distances of the surfaces [m]", [0.001, 0.003, 0.01, 0.03, 0.1], min_length=1)
    placements: Count = key("How often both bodies are turned and placed at random", 6)


class Settings(Block):
    """Bounding structures compared on deforming scenes, chapter 4 of paper 3."""

    frames: Count = key("Frames of each scene", 200)
    refinements: Whole = key(
        "Refinements of surfaces: 276 triangles of a liver, four times as many each time", 2, ge=0, le=5
    )
    depths: list[Pair[Index]] = key(
        "Composite trees that are compared: layers of spheres, and layers of both spheres and boxes; the first one is "
        "also scaled",
        [[1, 1], [2, 2], [4, 2], [4, 4], [8, 4]],
        min_length=1,
    )
    triangles: list[Annotated[Whole, Field(ge=16)]] = key(
        "Numbers of triangles for which building, refitting and querying are timed",
        [1000, 10000, 100000, 1000000],
        min_length=1,
    )
    stopped: Stopped = key("Contacts from trees that are stopped at a layer, precision for time", {})
    apart: Apart = key("The cost of showing that two bodies are apart", {})
