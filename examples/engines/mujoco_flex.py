"""Answer a folder of `palpate ask` with MuJoCo's flex: linear tetrahedra, law of Saint Venant and Kirchhoff.

    pip install mujoco numpy
    python mujoco_flex.py FOLDER [answers.npz] [--levels 0 1]

Static equilibrium is the rest of steps of 1 s: at that length the integrator
`discrete` all but drops inertia, so a step is close to a step of Newton's method.
"""

import argparse
import json
import platform
import time
from pathlib import Path

import mujoco
import numpy as np

MODEL = """<mujoco><size memory="2G"/>
<option timestep="1" gravity="0 0 0" integrator="discrete" solver="CG" iterations="100" tolerance="1e-10"/><worldbody>
<flexcomp name="body" type="gmsh" file="body.msh" dim="3" mass="{mass}" radius="0.0005" dof="full">
<edge equality="false"/><elasticity young="{young}" poisson="{poisson}" damping="0"/>
<contact selfcollide="none" contype="0" conaffinity="0"/><pin id="{held}"/></flexcomp></worldbody></mujoco>"""


class Body:
    """One level of the mesh as a flex."""

    def __init__(self, folder: Path, level: int, material: dict) -> None:
        """Compile the model; `region` must have one material, since a flex has one."""
        mesh = np.load(folder / f"level_{level}.npz")
        self.nodes_m, self.triangles = mesh["nodes_m"], mesh["triangles"]
        corners = self.nodes_m[mesh["tetrahedra"]]
        volume = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])).sum() / 6
        text = MODEL.format(
            mass=material["density_kg_m3"] * volume,
            young=material["young_pa"],
            poisson=material["poisson"],
            held=" ".join(map(str, mesh["held"])),
        )
        file = (folder / f"level_{level}.msh").read_bytes()
        begin = time.perf_counter()
        self.model = mujoco.MjModel.from_xml_string(text, {"body.msh": file})
        self.data = mujoco.MjData(self.model)
        # a pinned node belongs to the world, so the nodes that move say which body is theirs
        self.bodies = self.model.flex_vertbodyid
        self.moving = self.bodies > 0
        self.rest = self.positions()
        self.preparation_s = time.perf_counter() - begin

    def positions(self) -> np.ndarray:
        """Where the nodes are now."""
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_flex(self.model, self.data)
        return self.data.flexvert_xpos.copy()

    def press(self, force_n: np.ndarray, steps: int) -> tuple[np.ndarray, bool]:
        """Displacements after so many steps at most, and whether motion ended before."""
        mujoco.mj_resetData(self.model, self.data)
        self.data.xfrc_applied[self.bodies[self.moving], :3] = force_n[self.moving]
        before = self.rest
        for _ in range(steps):
            mujoco.mj_step(self.model, self.data)
            now = self.positions()
            if not np.isfinite(now).all():
                return np.full_like(now, np.nan), False
            if np.abs(now - before).max() < 1e-6 * np.abs(now - self.rest).max():
                return now - self.rest, True
            before = now
        return now - self.rest, False


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("answers", nargs="?", default="answers_mujoco.npz")
    parser.add_argument("--levels", type=int, nargs="+", default=[0, 1])
    parser.add_argument("--most", type=int, default=500, help="steps after which a press has failed to come to rest")
    arguments = parser.parse_args()
    asked = json.loads((arguments.folder / "questions.json").read_text())
    if asked["kind"] != "press":
        raise SystemExit(f"{asked['scene']} asks for a {asked['kind']}; this script answers presses only")
    if len(asked["materials"]) > 1:
        raise SystemExit(f"{asked['scene']} has {len(asked['materials'])} materials, and a flex has one")
    mujoco.set_mju_user_warning(lambda text: None)  # large steps warn at each
    loads = np.load(arguments.folder / "loads.npz")
    # (level, steps or None: to rest)
    settings = [(arguments.levels[0], 3), *((level, None) for level in arguments.levels)]
    answers = {
        "digest": asked["digest"],
        "engine": "MuJoCo flex",
        "version": mujoco.__version__,
        "hardware": f"{platform.machine()} processor, 1 thread",
        "law": "st_venant_kirchhoff",
        "settings": [f"level {level}, " + (f"{steps} steps" if steps else "to rest") for level, steps in settings],
        "converged": [steps is None for _, steps in settings],
    }
    for i, (level, steps) in enumerate(settings):
        body, found, seconds = Body(arguments.folder, level, asked["materials"][0]), [], []
        for force_n in loads[f"level_{level}/nodal_force_n"]:
            begin = time.perf_counter()
            displacement_m, rested = body.press(force_n, steps or arguments.most)
            seconds.append(time.perf_counter() - begin)
            found.append(displacement_m if rested or steps else np.full_like(displacement_m, np.nan))
        mb = (mujoco.mj_sizeModel(body.model) + body.data.maxuse_arena) / 1e6
        failed = ~np.isfinite(found).all(axis=(1, 2))
        print(answers["settings"][i], f"{np.median(seconds):.3g} s, {failed.sum()} failed", flush=True)
        setting = {"displacement_m": found, "failed": failed, "nodes_m": body.nodes_m, "triangles": body.triangles}
        setting |= {"seconds": np.where(failed, np.nan, seconds), "preparation_s": body.preparation_s, "memory_mb": mb}
        answers |= {f"setting_{i}/{name}": value for name, value in setting.items()}
    np.savez_compressed(arguments.answers, **answers)


if __name__ == "__main__":
    main()
