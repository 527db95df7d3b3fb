"""Keys of settings that are gone, and what to write instead; the next release drops this."""

from fnmatch import fnmatchcase

GONE = {
    "scenes.*.effects": (
        "a scene's effects are its blocks; remove the list and the blocks that it does not name, write {} for what "
        "it names without a block, as rayleigh: {}, and held: false if it does not name held (auto also chose damping, "
        "which is rayleigh, of springs kelvin and of shape_matching velocity_damping; bending of sheets, body_springs "
        "of surfaces, and volume of springs with a Poisson's ratio above 1/4)"
    ),
}
"""By the place of a key, with * for a name: why it is gone, and what to write instead."""


def gone(place: str) -> str:
    """Return what to write instead of the key at a place such as scenes.mine.effects; empty if it never was one."""
    return next((instead for pattern, instead in GONE.items() if fnmatchcase(place, pattern)), "")
