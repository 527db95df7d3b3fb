"""Answer a folder of `palpate ask` with Newton's vertex block descent on the processor: a quadratic neo-Hookean law.

    pip install newton warp-lang numpy
    python newton_vbd.py FOLDER [answers.npz] [--level 0]

Equilibrium is where a damped motion ends: velocities lose a share at each step. A step too long for its sweeps stops
elsewhere than at the equilibrium, so a setting that has converged cuts the step.
"""

import argparse
import json
import platform
import time
from pathlib import Path

import newton
import numpy as np
import warp as wp
from newton.solvers import SolverVBD

# name, length of a step [s], time simulated at most [s], whether that has converged
SETTINGS = (("0.25 s", 1 / 240, 0.25, False), ("0.5 s", 1 / 240, 0.5, False), ("to rest", 1 / 240, 20.0, True))
ITERATIONS = 5
KEPT = 0.98  # of the velocity at each step
REST = 1e-4  # of the largest displacement: motion in 24 steps, below which it is at rest


class Body:
    """One level of the mesh as particles and tetrahedra."""

    def __init__(self, folder: Path, level: int, materials: list[dict]) -> None:
        mesh = np.load(folder / f"level_{level}.npz")
        self.nodes_m, self.triangles = mesh["nodes_m"], mesh["triangles"]
        begin = time.perf_counter()
        young, poisson = (np.array([m[name] for m in materials])[mesh["region"]] for name in ("young_pa", "poisson"))
        mu, lame = young / (2 * (1 + poisson)), young * poisson / ((1 + poisson) * (1 - 2 * poisson))
        builder = newton.ModelBuilder(gravity=(0.0, 0.0, 0.0))
        builder.add_soft_mesh(
            pos=wp.vec3(0.0, 0.0, 0.0),
            rot=wp.quat_identity(),
            scale=1.0,
            vel=wp.vec3(0.0, 0.0, 0.0),
            vertices=[wp.vec3(*node) for node in self.nodes_m.tolist()],
            indices=mesh["tetrahedra"].ravel().tolist(),
            density=materials[0]["density_kg_m3"],
            k_mu=mu.tolist() if len(materials) > 1 else float(mu[0]),
            # the engine's law has k = lambda + mu in it and adds mu itself
            k_lambda=lame.tolist() if len(materials) > 1 else float(lame[0]),
            k_damp=0.0,
            add_surface_mesh_edges=False,
        )
        for node in mesh["held"].tolist():
            builder.particle_mass[node] = 0.0
            builder.particle_flags[node] = builder.particle_flags[node] & ~int(newton.ParticleFlags.ACTIVE)
        builder.color()
        self.model = builder.finalize(device="cpu")
        self.solver = SolverVBD(self.model, iterations=ITERATIONS)
        self.preparation_s = time.perf_counter() - begin

    def press(self, force_n: np.ndarray, step_s: float, most_s: float, to_rest: bool) -> np.ndarray:
        """Displacements at the end of the motion; NaN if it should have come to rest and did not."""
        a, b, control = self.model.state(), self.model.state(), self.model.control()
        start = a.particle_q.numpy().astype(float)
        before, force = start, force_n.astype(np.float32)
        for count in range(1, round(most_s / step_s) + 1):
            a.clear_forces()
            a.particle_f.assign(force)
            self.solver.step(a, b, control, None, step_s)
            a, b = b, a
            a.particle_qd.assign(KEPT * a.particle_qd.numpy())
            if to_rest and count % 24 == 0:
                now = a.particle_q.numpy().astype(float)
                if np.abs(now - before).max() < REST * np.abs(now - start).max():
                    return now - start
                before = now
        now = a.particle_q.numpy().astype(float)
        return np.full_like(now, np.nan) if to_rest else now - start


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("answers", nargs="?", default="answers_newton.npz")
    parser.add_argument("--level", type=int, default=0)
    arguments = parser.parse_args()
    asked = json.loads((arguments.folder / "questions.json").read_text())
    if asked["kind"] != "press":
        raise SystemExit(f"{asked['scene']} asks for a {asked['kind']}; this script answers presses only")
    forces_n = np.load(arguments.folder / "loads.npz")[f"level_{arguments.level}/nodal_force_n"]
    answers = {
        "digest": asked["digest"],
        "engine": "Newton VBD",
        "version": newton.__version__,
        "law": "quadratic_neo_hookean",
    }
    answers |= {"hardware": f"{platform.machine()} processor, 1 thread", "converged": [done for *_, done in SETTINGS]}
    answers |= {"settings": [f"level {arguments.level}, {name}" for name, *_ in SETTINGS]}
    body = Body(arguments.folder, arguments.level, asked["materials"])
    body.press(forces_n[0], 1 / 240, 1 / 240, False)  # compile, which is not part of an answer
    for i, (_, *how) in enumerate(SETTINGS):
        found, seconds = [], []
        for force_n in forces_n:
            begin = time.perf_counter()
            found.append(body.press(force_n, *how))
            seconds.append(time.perf_counter() - begin)
        failed = ~np.isfinite(found).all(axis=(1, 2))
        print(answers["settings"][i], f"{np.median(seconds):.3g} s, {failed.sum()} failed", flush=True)
        setting = {"displacement_m": found, "failed": failed, "nodes_m": body.nodes_m, "triangles": body.triangles}
        setting |= {"seconds": np.where(failed, np.nan, seconds), "preparation_s": body.preparation_s}
        answers |= {f"setting_{i}/{name}": value for name, value in setting.items()}
    np.savez_compressed(arguments.answers, **answers)


if __name__ == "__main__":
    main()
