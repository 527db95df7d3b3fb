"""Settings of how kernels scale."""

from typing import Annotated

from pydantic import Field

from palpate.setting_types import Block, Some, Whole, key

Hundreds = Some[Annotated[Whole, Field(ge=100)]]


class Settings(Block):
    """How cost and memory of each kernel grow with its size; that over cores takes all there are."""

    fem: Some[Annotated[Whole, Field(ge=1, le=5)]] = key(
        "Refinements of the liver's mesh of 628 tetrahedra", [1, 2, 3, 4]
    )
    fine_nodes: Hundreds = key("Fine surface nodes that enrichment gives displacements to", [1000, 4000, 16000, 64000])
    samples: Some[Annotated[Whole, Field(ge=20)]] = key("Training samples of enrichment", [30, 60, 120, 240])
    triangles: Some[Annotated[Whole, Field(ge=16)]] = key(
        "Triangles in composite trees", [1000, 10000, 100000, 1000000]
    )
    particles: Hundreds = key("Particles that shape matching moves, in objects of 100", [1000, 10000, 100000, 1000000])
