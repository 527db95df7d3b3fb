"""Write identified numbers for palpate, SOFA, MuJoCo and Newton into a folder, each modulus corrected for the mesh."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from palpate.benchmark.touch import Touch
from palpate.bodies.body import Body
from palpate.effects.instrument import Instrument
from palpate.errors import NotConverged
from palpate.files import write_whole
from palpate.identification.export import mujoco, newton, palpate_config, sofa
from palpate.identification.export.numbers import EngineMesh, Numbers
from palpate.identification.export.pressed_mesh import Stiffer, pressed
from palpate.identification.forward import Forward
from palpate.identification.on_body import touch_of
from palpate.identification.presses import Press

MOST_PLACES = 8
"""Presses that are repeated on the mesh for engines, spread over all."""
SHARES = (1.0, 0.7, 0.4)
"""Depths over those of the presses that are tried in turn: some laws have no equilibrium under a ball deep in."""
LAWS = {"mujoco": mujoco.LAW, "sofa": sofa.LAW, "newton": newton.LAW}
MOST_NODES = 10_000
"""Of the mesh for engines. Under a ball smaller than its elements forces are chance: on levels of 190, 1145 and 7865
nodes of a liver they differ from place to place by 59, 18 and 9 %, with an 8 mm ball 2.4 mm deep."""


def engine_level(body: Body) -> int:
    """Return the finest level of at most MOST_NODES nodes."""
    return max((k for k, mesh in enumerate(body.levels) if len(mesh.nodes) <= MOST_NODES), default=0)


def export(
    numbers: Numbers,
    body: Body,
    level: int,
    instrument: Instrument,
    presses: Sequence[Press],
    organ: Forward,
    values: Mapping[str, float],
    folder: Path,
) -> dict:
    """Write the files of all engines into ``folder``; return the content of ``exported.json``.

    level : of ``body``, the mesh for engines; presses : that the numbers were identified from, with places
    organ, values : the forward model of these presses, and the identified parameters
    Some presses are repeated on the mesh with each engine's law; where one has no answer, all are made less deep.
    InputError for presses that are not on the body, NotConverged where none has an answer on the mesh.
    """
    chosen = np.unique(np.linspace(0, len(presses) - 1, MOST_PLACES).round().astype(int))
    repeated = [touch_of(body, instrument, presses[i], float(presses[i].depth_m.max())) for i in chosen]

    def organ_n(touches: Sequence[Touch]) -> np.ndarray:
        pairs = zip(chosen, touches, strict=True)
        return np.array([organ.forces(int(i), np.array([touch.depth_m]), values)[0] for i, touch in pairs])

    def stiffer(law: str) -> Stiffer:
        for share in SHARES:
            touches = [replace(touch, depth_m=share * touch.depth_m) for touch in repeated]
            try:
                results = pressed(body, level, law, numbers.poisson, touches, organ_n(touches))
            except NotConverged:
                if share == SHARES[-1]:
                    raise
                continue
            if np.isfinite(results.ratios).all():
                break
        return results

    meshes = {engine: EngineMesh(body, level, numbers, stiffer(law)) for engine, law in LAWS.items()}
    mesh, name = body.levels[level], numbers.name
    facts = {
        "young_pa": numbers.young_pa,
        "poisson": numbers.poisson,
        "density_kg_m3": numbers.density_kg_m3,
        "damping_s": numbers.damping_s,
        "nodes": len(mesh.nodes),
        "engines": {engine: _facts(each) for engine, each in meshes.items()},
        "presses": [
            {
                "tip_m": touch.poses[body].tip.tolist(),
                "direction": touch.direction.tolist(),
                "depth_m": touch.depth_m,
                "force_n": float(force) * numbers.young_pa,
            }
            for touch, force in zip(repeated, organ_n(repeated), strict=True)
        ],
    }
    texts = {
        f"{name}_palpate.yaml": palpate_config.snippet(numbers),
        f"{name}.xml": mujoco.scene(meshes["mujoco"], f"{name}.msh", repeated[0]),
        f"{name}_sofa.py": sofa.scene(meshes["sofa"], f"{name}.msh"),
        f"{name}_newton.py": newton.script(meshes["newton"], f"{name}.npz"),
        "exported.json": json.dumps(facts, indent=2),
    }
    for file, text in texts.items():
        with write_whole(folder / file) as temporary:
            temporary.write_text(text, encoding="utf-8")
    with write_whole(folder / f"{name}.msh") as temporary:
        temporary.write_bytes(mujoco.gmsh(mesh))
    with write_whole(folder / f"{name}.npz") as temporary:
        np.savez(temporary, nodes_m=mesh.nodes, tetrahedra=mesh.tetrahedra, held=body.anchors[level])
    return facts


def _facts(mesh: EngineMesh) -> dict:
    """Return what ``exported.json`` has of one engine."""
    stiffer = mesh.stiffer
    return {
        "young_pa": mesh.young_pa,
        "poisson": stiffer.poisson,
        "law": Path(stiffer.law).stem,
        "stiffer_by": stiffer.factor - 1.0,
        "scatter_of_places": stiffer.scatter,
        "depth_m": stiffer.depth_m.tolist(),
        "force_over_organ": [None if np.isnan(each) else float(each) for each in stiffer.ratios],
    }
