"""Label, colour and marker of each bounding structure, in every figure and sentence about collision."""

from collections.abc import Sequence

from palpate.errors import InputError
from palpate.report.style import Look

STRUCTURES = {
    "sphere": Look("spheres", "#d55e00", "o"),
    "aabb": Look("AABBs", "#0072b2", "s"),
    "composite": Look("composite (the paper)", "#009e73", "*"),
    "obb": Look("OBBs", "#7a3b63", "D"),
    "dop14": Look("14-DOPs", "#e6b400", "v"),
    "dop18": Look("18-DOPs", "#8a6d00", "^"),
    "obb_coal_refit": Look("coal, OBBs, refitted", "#9a9a9a", "P"),
    "obb_coal": Look("coal, OBBs, rebuilt", "#6a6a6a", "X"),
    "obb_rss_fcl": Look("python-fcl, OBB-RSS, rebuilt", "#222222", "h"),
}
"""Every structure that may occur in a table, in the order of figures."""


_DEPTHS = ("#a6dcc8", "#66c2a5", "#009e73", "#00664a", "#003b2b")
"""Shades of the composite trees, darker with depth."""


def look(structure: str, depths: str = "", among: Sequence[str] = ()) -> Look:
    """Look up the look of a structure; raises InputError for an unknown one, so that no figure invents a colour.

    depths : of a composite tree, which gets a label and a shade of its own ``among`` all depths of the figure
    """
    try:
        shown = STRUCTURES[structure]
    except KeyError:
        raise InputError(
            f"structure {structure} has no colour: give it one in palpate/studies/collision/figures/collision_looks.py"
        ) from None
    if not depths:
        return shown
    # one alone gets the middle shade
    first = (len(_DEPTHS) - len(among)) // 2
    shade = _DEPTHS[min(max(first, 0) + list(among).index(depths), len(_DEPTHS) - 1)] if among else shown.colour
    return Look(f"composite {depths}", shade, shown.marker)


def depths_of(table) -> list[str]:
    """Return the depths of all composite trees in a table, sorted by layers of spheres, then of both."""
    found = [depths for depths in table["depths"].unique() if depths]
    return sorted(found, key=lambda depths: [int(layers) for layers in depths.split("/")])


def ranked(table):
    """Sort the rows of a table by STRUCTURES and depths, which become text ("" where there are none)."""
    table = table.assign(depths=table["depths"].fillna("").astype(str))
    for structure in table["structure"].unique():
        look(structure)
    order = {"structure": list(STRUCTURES), "depths": ["", *depths_of(table)]}
    # stable sorts, so that scenes and numbers of triangles keep their order
    for column in ("depths", "structure"):
        table = table.sort_values(
            column, key=lambda values, column=column: values.map(order[column].index), kind="stable"
        )
    return table
