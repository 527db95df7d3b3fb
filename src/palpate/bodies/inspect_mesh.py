"""Facts about a mesh file that decide how it becomes a body, found without making the body."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from palpate.bodies.mesh_shapes import load_shape, remeshed_by_default
from palpate.bodies.units import guess_scale, in_words


@dataclass(frozen=True)
class MeshFacts:
    """Content of a mesh file and what is assumed of it.

    kind : ``surface`` or ``tetrahedra``
    nodes, triangles, tetrahedra : counts; of a surface, the tetrahedra are 0; of tetrahedra, the triangles are those
        of the boundary and the nodes include the inner ones
    size : longest side of the bounding box [file's unit]
    scale_m : guessed length of the file's unit [m]; None if no unit makes it an organ's size
    remeshed : whether its surface is remeshed unless ``surface_nodes`` says otherwise
    notes : sentences for a person
    """

    kind: str
    nodes: int
    triangles: int
    tetrahedra: int
    size: float
    scale_m: float | None
    remeshed: bool
    notes: list[str] = field(default_factory=list)


def inspect(path: str | Path) -> MeshFacts:
    """Collect the facts of a mesh file; raise InputError if it cannot be read or holds no body."""
    path = Path(path)
    points, triangles, tetrahedra = load_shape(path)
    size = float(np.ptp(points, axis=0).max())
    guess = guess_scale(size)
    remeshed = remeshed_by_default(points, triangles, tetrahedra)
    notes = [
        f"its longest side is {size:.4g} units, {in_words(size * guess[1])} if its unit is the {guess[0]}"
        if guess
        else f"its longest side of {size:.4g} units is an organ's size neither in mm nor in cm or m"
    ]
    if remeshed:
        notes.append(f"its surface of {len(points)} nodes is remeshed")
    return MeshFacts(
        "surface" if tetrahedra is None else "tetrahedra",
        len(points),
        len(triangles),
        0 if tetrahedra is None else len(tetrahedra),
        size,
        guess[1] if guess else None,
        remeshed,
        notes,
    )
