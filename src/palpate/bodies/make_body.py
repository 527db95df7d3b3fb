"""Construction of a body from its entry in the config."""

import math
from collections.abc import Callable

from palpate.bodies.anchors import choose_anchors, default_anchors
from palpate.bodies.body import Body, Material, nest
from palpate.bodies.mesh import TetMesh
from palpate.bodies.mesh_quality import check_quality
from palpate.bodies.sheet import Sheet, sheet
from palpate.errors import InputError

# what to do about bad elements, of a mesh as it is in the file and of a remeshed one
REMEDIES = {
    False: "improve the mesh in the program that made it, or give surface_nodes: 140 to have it remeshed",
    True: "give more surface_nodes",
}


def make_body(name: str, entry: dict) -> Body:
    """Make the coarse mesh that ``entry["kind"]`` asks for, choose its anchors and refine it.

    Raises InputError if the entry cannot be used.
    """
    kinds = {"cylinder": _cylinder, "liver": _liver, "file": _file, "box": _box, "sheet": _sheet, "ct": _ct}
    if entry["kind"] not in kinds:
        raise InputError(f"body {name}: kind {entry['kind']!r} is unknown; give one of {', '.join(kinds)}.")
    material = _material(name, entry)
    made = kinds[entry["kind"]](entry)
    # only a CT and a file show more of the surface than the coarse mesh has
    mesh, snap, remeshed = made if isinstance(made, tuple) else (made, None, False)
    rule = entry.get("anchors") or default_anchors(name, mesh)
    if remeshed and "nodes" in rule:
        raise InputError(
            f"body {name}: anchors.nodes counts nodes of a mesh that is remeshed; hold nodes by plane or sphere, or "
            "give surface_nodes as many as the file has."
        )
    # a sheet has one level and no such entry
    body = nest(name, mesh, entry.get("refinements", 0), choose_anchors(name, rule, mesh), material, snap)
    if entry["kind"] in ("file", "ct"):
        check_quality(body, REMEDIES[remeshed])
    return body


def _cylinder(entry: dict) -> TetMesh:
    from palpate.bodies.cylinder import cylinder

    return cylinder(entry["length_m"], entry["radius_m"])


def _liver(entry: dict) -> TetMesh:
    from palpate.bodies.liver import liver

    return liver(entry["length_m"])


def _file(entry: dict) -> tuple[TetMesh, Callable | None, bool]:
    from palpate.bodies.body_from_mesh import build

    return build(entry)


def _box(entry: dict) -> TetMesh:
    from palpate.bodies.box import box

    return box(entry["sizes_m"], entry["divisions"])


def _sheet(entry: dict) -> Sheet:
    return sheet(entry["sizes_m"], entry["divisions"], entry["thickness_m"])


def _ct(entry: dict) -> tuple[TetMesh, Callable | None, bool]:
    from palpate.bodies.ct.mesh_from_ct import build

    return *build(entry), True


def _material(name: str, entry: dict) -> Material:
    """Check the constants: elastic energy must be positive and finite (at ν = 0.5 the volume cannot change)."""
    young, poisson, density = entry["young_pa"], entry["poisson"], entry["density_kg_m3"]
    for key, value in (("young_pa", young), ("density_kg_m3", density)):
        if not (value > 0 and math.isfinite(value)):
            raise InputError(f"body {name}: {key} is {value}; give a positive number.")
    if not -1 < poisson < 0.5:
        raise InputError(f"body {name}: poisson is {poisson}; give a number above -1 and below 0.5, such as 0.49.")
    return Material(young, poisson, density)
