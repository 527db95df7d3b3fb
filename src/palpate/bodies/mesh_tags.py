"""Tags of the tetrahedra in a mesh file, by which regions of a body are named."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from palpate.errors import InputError, suggest

KNOWN = ("gmsh:physical", "medit:ref", "CellEntityIds", "cell_tags", "region", "label")
"""Names of cell data that hold tags, in the order in which they are looked for; the second is medit's, the third that
of gmsh's VTK files."""
LISTED = 8
"""Tags that a message lists, most elements first."""


@dataclass
class Tags:
    """Groups of tetrahedra, which may overlap.

    groups : tag → numbers (k,) of tetrahedra in the file's order; names : of tags, as far as the file has them
    fault : why there are none, for a message
    """

    groups: dict[int, np.ndarray] = field(default_factory=dict)
    names: dict[int, str] = field(default_factory=dict)
    fault: str = "its tetrahedra have no tags"


def gmsh_tags(gmsh: Any, kind: int) -> Tags:
    """Collect the elements of a type by physical group, or if no volume is in one, by the geometrical tag."""
    numbers = gmsh.model.mesh.getElementsByType(kind)[0]
    order = np.argsort(numbers)
    physical: dict[int, list[np.ndarray]] = {}
    geometrical: dict[int, list[np.ndarray]] = {}
    for _, volume in gmsh.model.getEntities(3):
        found = gmsh.model.mesh.getElementsByType(kind, volume)[0]
        places = order[np.searchsorted(numbers, found, sorter=order)]
        geometrical[int(volume)] = [places]
        for tag in gmsh.model.getPhysicalGroupsForEntity(3, volume):
            physical.setdefault(int(tag), []).append(places)
    chosen = physical or geometrical
    names = {tag: gmsh.model.getPhysicalName(3, tag) for tag in physical}
    groups = {tag: np.sort(np.concatenate(parts)) for tag, parts in chosen.items()}
    return Tags(
        {tag: found for tag, found in groups.items() if len(found)}, {t: name for t, name in names.items() if name}
    )


def cell_tags(kinds: list[str], cell_data: dict[str, list]) -> Tags:
    """Take tags from the cell data of a VTK, VTU or medit file: whole numbers, one for each tetrahedron.

    kinds : meshio's name for the type of each block of cells; cell_data : name → one array for each block
    """
    found: dict[str, np.ndarray] = {}
    for name, blocks in cell_data.items():
        values = [np.asarray(block) for block, kind in zip(blocks, kinds, strict=True) if kind == "tetra"]
        if values and all(each.ndim == 1 and _are_whole(each) for each in values):
            found[name] = np.concatenate(values).astype(np.int64)
    key = next((name for name in KNOWN if name in found), next(iter(found), ""))
    if not key:
        return Tags()
    if len(found) > 1 and key not in KNOWN:
        return Tags(fault=f"its cell data {', '.join(sorted(found))} could all be tags; name the right one region")
    return Tags({int(tag): np.flatnonzero(found[key] == tag) for tag in np.unique(found[key])})


def tagged(path: Path, tags: Tags | None, wanted: int | str) -> np.ndarray:
    """Return the numbers (k,) of the tetrahedra with a tag, given by number or name; InputError if there are none."""
    if tags is None:
        raise InputError(f"{path}: it has no tetrahedra and so no tags; give the region by a sphere.")
    if not tags.groups:
        raise InputError(f"{path}: {tags.fault}, or give the region by a sphere.")
    for tag, elements in tags.groups.items():
        if wanted == (tags.names.get(tag) if isinstance(wanted, str) else tag):
            return elements
    guess = suggest(str(wanted), list(tags.names.values()), "") if isinstance(wanted, str) else ""
    near = f" ({guess})" if guess.startswith("did") else ""
    raise InputError(f"{path}: no tetrahedron has the tag {wanted}{near}; there are {_listed(tags)}.")


def _listed(tags: Tags) -> str:
    most = sorted(tags.groups, key=lambda tag: (-len(tags.groups[tag]), tag))
    said = [
        f"{tag} {tags.names.get(tag, '')}".strip() + f" ({len(tags.groups[tag])} tetrahedra)" for tag in most[:LISTED]
    ]
    more = f" and {len(most) - LISTED} more" if len(most) > LISTED else ""
    return ", ".join(said) + more


def _are_whole(values: np.ndarray) -> bool:
    return values.dtype.kind in "iu" or (values.dtype.kind == "f" and bool((values == np.round(values)).all()))
