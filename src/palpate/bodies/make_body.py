"""Construction of a body from its entry in the config."""

from collections.abc import Callable
from dataclasses import replace

from palpate.bodies import body_from_mesh
from palpate.bodies.body import Body, nest
from palpate.bodies.ct import mesh_from_ct
from palpate.bodies.ct.masses import nodal_densities
from palpate.bodies.material import read_material
from palpate.bodies.mesh_quality import check_quality
from palpate.bodies.organs import SHAPES, coarse_body, surface_of
from palpate.bodies.regions import balls_of, read_regions
from palpate.bodies.simple_shapes import box, cylinder, sheet
from palpate.bodies.supports import choose_anchors, default_anchors, read_bed
from palpate.bodies.surfaces.coarse_solid import NODES
from palpate.errors import InputError, about


def make_body(name: str, entry: dict) -> Body:
    """Make the coarse mesh that ``entry["kind"]`` asks for, choose its anchors and refine it.

    Raises InputError if the entry cannot be used; warnings begin with "bodies.<name>: ".
    """
    with about(f"bodies.{name}"):
        return _make(name, entry)


def _make(name: str, entry: dict) -> Body:
    kinds: dict[str, Callable] = {
        "cylinder": lambda e: cylinder(e["length_m"], e["radius_m"]),
        "file": body_from_mesh.build,
        "box": lambda e: box(e["sizes_m"], e["divisions"]),
        "sheet": lambda e: sheet(e["sizes_m"], e["divisions"], e["thickness_m"]),
        "ct": lambda e: (*mesh_from_ct.build(e), True),
        **dict.fromkeys(SHAPES, lambda e: coarse_body(SHAPES[e["kind"]], e["length_m"], balls_of(e))),
    }
    if entry["kind"] not in kinds:
        raise InputError(f"body {name}: kind {entry['kind']!r} is unknown; give one of {', '.join(kinds)}.")
    material = read_material(name, entry)
    made = kinds[entry["kind"]](entry)
    # a CT and a file show more of the surface than the coarse mesh has
    mesh, snap, remeshed = made if isinstance(made, tuple) else (made, None, False)
    bed = read_bed(name, entry["bed"], mesh) if "bed" in entry else None
    rule = entry.get("anchors") or (default_anchors(name, mesh) if bed is None else None)
    if remeshed and rule and "nodes" in rule:
        raise InputError(
            f"body {name}: anchors.nodes counts nodes of a mesh that is remeshed; hold nodes by plane or sphere, or "
            "give surface_nodes as many as the file has."
        )
    # a sheet has one level and no such entry
    anchors = choose_anchors(name, rule, mesh, bed)
    regions = read_regions(name, entry, mesh, material, remeshed)
    smooth = surface_of(entry) if entry.get("smooth") else None
    body = nest(name, mesh, entry.get("refinements", 0), anchors, material, snap, bed, regions, smooth)
    if moves_with_ct(entry):
        for region, constants in entry.get("regions", {}).items():
            if "density_kg_m3" in constants:
                raise InputError(
                    f"body {name}: regions.{region} has a density_kg_m3, and the voxels of the CT have theirs; leave "
                    "it out, or give masses: uniform."
                )
        body = replace(body, densities=nodal_densities(entry, body.levels))
    if entry["kind"] in ("file", "ct"):
        check_quality(body.levels, _remedy(body, remeshed))
    return body


def _remedy(body: Body, remeshed: bool) -> str:
    """Return what to do about bad elements; a surface that has few nodes already is not remeshed to as many."""
    if remeshed:
        return "give more surface_nodes"
    improve = "improve the mesh in the program that made it"
    if len(body.coarse.surface) <= NODES[0]:
        return improve
    return f"{improve}, or give surface_nodes: {NODES[0]} to have it remeshed"


def moves_with_ct(entry: dict) -> bool:
    """Return whether the masses of a config entry's nodes are those of its CT's voxels; an MRI has no densities."""
    return entry["kind"] == "ct" and entry.get("modality", "ct") == "ct" and entry.get("masses", "ct") == "ct"
