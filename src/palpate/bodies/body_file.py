"""Body files (HDF5), so that a body is made only once."""

from pathlib import Path

from palpate.bodies.body import Body
from palpate.bodies.organs import SmoothSurface
from palpate.stores import store, stored


def save(body: Body, path: str | Path) -> None:
    """Write a body; the file appears under its name only once it is complete."""
    store(body, path, compressed=True)


def load(path: str | Path) -> Body:
    """Read a body; raise InputError naming the field if the file is missing, damaged or of another version."""
    return stored(Body, path, SmoothSurface=SmoothSurface)
