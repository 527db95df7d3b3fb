"""Answer a folder of `palpate ask` with SOFA: to be read and adapted; it has not been run.

    python sofa_scene.py FOLDER [answers.npz] [--level 0]      in a Python that has SofaRuntime (SOFA 24.06 or later)

SOFA's corotational elements take the rotation of a whole linear tetrahedron and linear strain after it: close to the
folder's law, and not the same, since their force leaves out how the rotation changes. Hence the law's name below.
"""

import argparse
import json
import platform
import time
from pathlib import Path

import numpy as np
import Sofa
import Sofa.Core
import Sofa.Simulation

PLUGINS = "StateContainer Topology.Container.Dynamic SolidMechanics.FEM.Elastic MechanicalLoad Constraint.Projective"
PLUGINS += " ODESolver.Backward LinearSolver.Direct LinearSystem"
# name, steps of Newton's method, whether that has converged
SETTINGS = (("1 step", 1, False), ("3 steps", 3, False), ("to equilibrium", 50, True))
STILL = 1e-6  # of the largest displacement: a step's motion below which there is equilibrium


def scene(mesh, materials: list[dict]) -> tuple[Sofa.Core.Node, object, object]:
    """The body at rest, its state and its forces: one Newton step of the static solver in each step of SOFA."""
    root = Sofa.Core.Node("root")
    root.gravity, root.dt = [0.0, 0.0, 0.0], 1.0
    for plugin in PLUGINS.split():
        root.addObject("RequiredPlugin", name=f"Sofa.Component.{plugin}")
    root.addObject("DefaultAnimationLoop")
    body = root.addChild("body")
    body.addObject("StaticSolver", newton_iterations=1)
    body.addObject("SparseLDLSolver", template="CompressedRowSparseMatrixMat3x3d")
    body.addObject(
        "TetrahedronSetTopologyContainer", position=mesh["nodes_m"].tolist(), tetrahedra=mesh["tetrahedra"].tolist()
    )
    body.addObject("TetrahedronSetGeometryAlgorithms", template="Vec3d")
    state = body.addObject("MechanicalObject", template="Vec3d", name="state")
    of_elements = [materials[region] for region in mesh["region"]]
    body.addObject(
        "TetrahedronFEMForceField",
        template="Vec3d",
        method="polar",
        youngModulus=[material["young_pa"] for material in of_elements],
        poissonRatio=materials[0]["poisson"],  # the component has one; check that the folder does, too
    )
    body.addObject("FixedProjectiveConstraint", indices=mesh["held"].tolist())
    nodes = list(range(len(mesh["nodes_m"])))
    pressing = body.addObject("ConstantForceField", indices=nodes, forces=np.zeros_like(mesh["nodes_m"]).tolist())
    Sofa.Simulation.initRoot(root)
    return root, state, pressing


def press(root, state, pressing, force_n: np.ndarray, steps: int, to_rest: bool) -> np.ndarray:
    """Displacements after so many steps; NaN if there should be equilibrium and is none."""
    Sofa.Simulation.reset(root)
    with pressing.forces.writeable() as forces:
        forces[:] = force_n
    rest = before = state.rest_position.array().copy()
    for _ in range(steps):
        Sofa.Simulation.animate(root, root.dt.value)
        now = state.position.array().copy()
        if to_rest and np.abs(now - before).max() < STILL * np.abs(now - rest).max():
            return now - rest
        before = now
    return np.full_like(rest, np.nan) if to_rest else now - rest


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("answers", nargs="?", default="answers_sofa.npz")
    parser.add_argument("--level", type=int, default=0)
    arguments = parser.parse_args()
    asked = json.loads((arguments.folder / "questions.json").read_text())
    if asked["kind"] != "press":
        raise SystemExit(f"{asked['scene']} asks for a {asked['kind']}; this script answers presses only")
    if len({material["poisson"] for material in asked["materials"]}) > 1:
        raise SystemExit(f"{asked['scene']} has several Poisson's ratios, and TetrahedronFEMForceField has one")
    mesh = np.load(arguments.folder / f"level_{arguments.level}.npz")
    forces_n = np.load(arguments.folder / "loads.npz")[f"level_{arguments.level}/nodal_force_n"]
    answers = {
        "digest": asked["digest"],
        "engine": "SOFA",
        "version": "24.06 or as installed",
        "law": "SOFA's corotational",
    }
    answers |= {"hardware": f"{platform.machine()} processor, 1 thread", "converged": [done for *_, done in SETTINGS]}
    answers |= {"settings": [f"level {arguments.level}, {name}" for name, *_ in SETTINGS]}
    begin = time.perf_counter()
    world = scene(mesh, asked["materials"])
    preparation_s = time.perf_counter() - begin
    for i, (_, *how) in enumerate(SETTINGS):
        found, seconds = [], []
        for force_n in forces_n:
            begin = time.perf_counter()
            found.append(press(*world, force_n, *how))
            seconds.append(time.perf_counter() - begin)
        failed = ~np.isfinite(found).all(axis=(1, 2))
        print(answers["settings"][i], f"{np.median(seconds):.3g} s, {failed.sum()} failed", flush=True)
        setting = {
            "displacement_m": found,
            "failed": failed,
            "nodes_m": mesh["nodes_m"],
            "triangles": mesh["triangles"],
        }
        setting |= {"seconds": np.where(failed, np.nan, seconds), "preparation_s": preparation_s}
        answers |= {f"setting_{i}/{name}": value for name, value in setting.items()}
    np.savez_compressed(arguments.answers, **answers)


if __name__ == "__main__":
    main()
