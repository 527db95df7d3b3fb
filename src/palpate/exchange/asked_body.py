"""Describe a body to other programs: its meshes on every level, what is held, its material, and the asked points."""

import ast
import tempfile
from dataclasses import asdict, replace
from importlib import import_module
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from palpate.bodies.body import Body
from palpate.bodies.material import Material, Tissue, kind_of
from palpate.bodies.mesh import TetMesh
from palpate.bodies.organs import SmoothSurface
from palpate.bodies.refinement import halfway
from palpate.bodies.supports import Bed
from palpate.errors import InputError
from palpate.exchange.folder import Questions


def body_arrays(body: Body) -> dict[str, dict[str, np.ndarray]]:
    """Return the arrays that describe a body, by file: one for each level, and ``asked``, the fine surface at rest."""
    files: dict[str, dict[str, np.ndarray]] = {}
    for i, (mesh, held) in enumerate(zip(body.levels, body.anchors, strict=True)):
        files[f"level_{i}"] = {
            "nodes_m": mesh.nodes, "tetrahedra": mesh.tetrahedra, "triangles": mesh.triangles,
            "held": held.astype(np.int64), "region": body.tissue(i).region.astype(np.int64),
        }  # fmt: skip
    surface = body.fine.surface
    files["asked"] = {
        "points_m": body.fine.nodes[surface], "normals": body.fine.normals[surface],
        "triangles": np.searchsorted(surface, body.fine.triangles), "node": surface.astype(np.int64),
    }  # fmt: skip
    return files


def questions_on(
    body: Body, info: dict[str, Any], loads: list[dict[str, Any]], more: dict[str, np.ndarray]
) -> Questions:
    """Return the questions of k ``loads`` on a body, without a truth.

    info : kind and scene, and what else questions.json has of all loads; more : further arrays (k, …) of the loads,
    beside their numbers. InputError for a sheet.
    """
    refuse_sheet(body)
    numbers = {name: np.array([load[name] for load in loads]) for name in loads[0] if name != "name"}
    return Questions(info | body_info(body) | {"loads": loads}, body_arrays(body) | {"loads": numbers | more})


def body_info(body: Body) -> dict[str, Any]:
    """Return the description of a body in questions.json: name, law, size, materials, levels and supports."""
    info: dict[str, Any] = {"body": body.name, "law": law_name(body.material.law), "size_m": body.fine.size}
    info["materials"] = [
        {name: value for name, value in asdict(each).items() if name != "law"} for each in body.tissue(0).materials
    ]
    info["levels"] = len(body.levels)
    if body.bed is not None:
        info["bed"] = {
            name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in asdict(body.bed).items()
        }
    if body.smooth is not None:
        info["smooth"] = asdict(body.smooth)
    return info


def body_of(questions: Questions) -> Body:
    """Rebuild the body of ``questions``; a law of a user's own file is a name only."""
    info, levels = questions.info, [questions.arrays[f"level_{i}"] for i in range(questions.info["levels"])]
    meshes = [TetMesh(each["nodes_m"], each["tetrahedra"]) for each in levels]
    materials = tuple(Material(**each, law=info["law"]) for each in info["materials"])
    steps = [halfway(len(mesh.nodes), mesh.edges) for mesh in meshes[:-1]]
    bed: dict[str, Any] = {
        name: np.array(value) if isinstance(value, list) else value for name, value in info.get("bed", {}).items()
    }
    return Body(
        info["body"], meshes, steps, [each["held"] for each in levels], materials[0],
        Bed(**bed) if bed else None,
        Tissue(materials, levels[0]["region"]) if len(materials) > 1 else None,
        smooth=SmoothSurface(**info["smooth"]) if "smooth" in info else None,
    )  # fmt: skip


FURTHER = ("quadratic_neo_hookean",)
"""Laws of palpate's that a body names by their file, such as that of an engine."""


def law_named(name: str) -> str:
    """Return palpate's law of that name as a material takes it, or "" where palpate has none."""
    if name in FURTHER:
        return str(files("palpate.effects.laws").joinpath(f"{name}.py"))
    return name if kind_of(name) else ""


def with_law(body: Body, name: str) -> Body:
    """Return ``body`` with palpate's law of the ``name`` that questions carry; InputError for one of a user's file."""
    law, regions = law_named(name), body.regions
    if not law:
        raise InputError(
            f"bodies.{body.name} has the law {name} of a file, which questions do not have in them, so that no truth "
            "is found from them; ask without --seed, for questions with the truth of the run."
        )
    if regions is not None:
        regions = replace(regions, materials=tuple(replace(each, law=law) for each in regions.materials))
    return replace(body, material=replace(body.material, law=law), regions=regions)


def law_name(law: str) -> str:
    """Return the name of a law, for one of a user's file that of the file."""
    return law if kind_of(law) else Path(law).stem


def formula(law: str) -> str:
    """Return the first paragraph of a law's docstring, which has its energy density."""
    if kind := kind_of(law):
        text = import_module(f"palpate.effects.laws.{kind}").__doc__
    else:
        text = ast.get_docstring(ast.parse(Path(law).read_text(encoding="utf-8")))
    return " ".join((text or f"the law of {law_name(law)}").split("\n\n")[0].split())


def pictures(body: Body) -> dict[str, bytes]:
    """Return mesh files of each level by name: VTU for ParaView, and MSH 2.2 for Gmsh."""
    import meshio

    files: dict[str, bytes] = {}
    for i, (mesh, held) in enumerate(zip(body.levels, body.anchors, strict=True)):
        is_held = np.isin(np.arange(len(mesh.nodes)), held).astype(np.int32)
        region = [body.tissue(i).region.astype(np.int32)]
        # Gmsh takes the first tag of an element for its part; meshio 5.3 writes no data of nodes that it can read again
        kinds: list[tuple[str, str, dict, dict, dict]] = [
            ("vtu", "vtu", {"held": is_held}, {"region": region}, {}),
            ("msh", "gmsh22", {}, {"gmsh:physical": region, "gmsh:geometrical": region}, {"binary": False}),
        ]
        for suffix, kind, at_nodes, in_cells, options in kinds:
            made = meshio.Mesh(mesh.nodes, [("tetra", mesh.tetrahedra)], point_data=at_nodes, cell_data=in_cells)
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder) / f"level.{suffix}"
                made.write(path, file_format=kind, **options)
                files[f"level_{i}.{suffix}"] = path.read_bytes()
    return files


def refuse_sheet(body: Body) -> None:
    """Raise InputError for a sheet, which has no tetrahedra."""
    if not len(body.fine.tetrahedra):
        raise InputError(f"bodies.{body.name} is a sheet, and questions are of solids; ask for another body.")
