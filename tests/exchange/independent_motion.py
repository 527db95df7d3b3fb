"""Answer a question of a motion with linear corotational elements and BDF2, from the folder, numpy and scipy alone.

python independent_motion.py QUESTIONS ANSWERS.npz
"""

import json
import runpy
import sys
import time
from pathlib import Path

import numpy as np
from scipy.sparse import coo_array, diags_array
from scipy.sparse.linalg import splu

Elements = runpy.run_path(str(Path(__file__).with_name("independent_p1.py")))["Elements"]


class Moving(Elements):
    """The elements of one level in motion: lumped masses, damping α M + β K⁺."""

    def __init__(self, folder: Path, level: int, head: dict):
        young, poisson = (np.array([each[key] for each in head["materials"]]) for key in ("young_pa", "poisson"))
        super().__init__(folder, level, young, poisson)
        with np.load(folder / "loads.npz") as loads:
            self.masses = np.repeat(loads[f"level_{level}/mass_kg"], 3)
            self.pushes = loads.get(f"level_{level}/nodal_force_n", np.zeros((1, 0, *self.rest.shape)))[0]
        at = (3 * self.elements[:, :, None] + np.arange(3)).reshape(len(self.elements), 12)
        self.rows, self.columns = np.repeat(at, 12, axis=1).ravel(), np.tile(at, (1, 12)).ravel()
        self.alpha, self.beta = head["damping"]["mass_1_s"], head["damping"]["stiffness_s"]

    def tangent(self, x, clamped):
        """Return the Hessian (3n, 3n) of the energy; ``clamped``: without negative eigenvalues of each element's C."""
        f = np.einsum("tai,taj->tij", x[self.elements], self.slopes)
        u, s, vt = np.linalg.svd(f)
        r = u @ vt  # no element of these motions is inverted
        mu, lam = self.mu[:, None, None], self.lam[:, None, None]
        pull = self.lam * (s.sum(axis=1) - 3)
        flat = r.reshape(-1, 9)
        c = 2 * mu * np.eye(9) + lam * flat[:, :, None] * flat[:, None, :]
        for i, j in ((0, 1), (1, 2), (0, 2)):
            spin = np.zeros((3, 3))
            spin[i, j], spin[j, i] = 2**-0.5, -(2**-0.5)
            mode = (u @ spin @ vt).reshape(-1, 9)
            bend = 2 * (pull - 2 * self.mu) / (s[:, i] + s[:, j])
            bend = np.maximum(bend, -2 * self.mu) if clamped else bend
            c += bend[:, None, None] * mode[:, :, None] * mode[:, None, :]
        c = c.reshape(-1, 3, 3, 3, 3)
        blocks = np.einsum("t,taj,tijkl,tbl->taibk", self.volume, self.slopes, c, self.slopes)
        return coo_array((blocks.ravel(), (self.rows, self.columns)), shape=(x.size, x.size)).tocsc()

    def load(self, told, t):
        """Return the forces (3n,) from outside at t."""
        found = np.outer(self.masses.reshape(-1, 3)[:, 0], told.get("gravity_m_s2", [0, 0, 0])).ravel()
        for push, force in zip(told.get("pushes", []), self.pushes, strict=True):
            rise = t - push["start_s"]
            fall = rise - push["press_s"] - push["hold_s"]
            share = smooth(rise, push["press_s"]) - smooth(fall, push["release_s"])
            found += share * force.ravel()
        return found

    def move(self, told, instants, steps):
        """Return displacements (f, n, 3) at ``instants``, in so many equal ``steps``."""
        h, rest, free = instants[-1] / steps, self.rest.ravel(), self.free
        x, v, found, before = rest.copy(), np.zeros(rest.size), [], None
        for number in range(1, steps + 1):
            if before is None:  # backward Euler
                base, speed, reach, seen = x, v, h, x
            else:
                base, speed, reach, seen = (
                    (4 * x - before[0]) / 3,
                    (4 * v - before[1]) / 3,
                    2 * h / 3,
                    2 * x - before[0],
                )
            damping = self.beta * self.tangent(seen.reshape(-1, 3), True) + self.alpha * diags_array(self.masses)
            load, z = self.load(told, number * h), x.copy()
            z[free] += reach * speed[free]
            for _ in range(50):
                inertia = self.masses * ((z - base) / reach - speed) / reach
                left = (load - self.forces(z.reshape(-1, 3)).ravel() - inertia - damping @ ((z - base) / reach))[free]
                if np.linalg.norm(left) <= 1e-11 * np.linalg.norm(self.masses * 9.81):
                    break
                whole = self.tangent(z.reshape(-1, 3), False) + damping / reach + diags_array(self.masses / reach**2)
                z[free] += splu(whole.tocsc()[free][:, free]).solve(left)
            else:
                return np.full((len(instants), *self.rest.shape), np.nan)
            before, x, v = (x, v), z, (z - base) / reach
            if number % (steps // len(instants)) == 0:
                found.append((x - rest).reshape(-1, 3))
        return np.array(found)


def smooth(since, lasts):
    q = min(max(since / lasts, 0.0), 1.0)
    return q * q * (3 - 2 * q)


def main(folder: Path, out: Path) -> None:
    head = json.loads((folder / "questions.json").read_text())
    instants = head["instants_s"]
    runs = [(0, len(instants)), (0, 4 * len(instants)), (1, 2 * len(instants))]
    answers = {"digest": head["digest"], "engine": "independent P1", "version": "1", "hardware": "this processor"}
    answers |= {"law": head["law"], "settings": [f"level {level}, {steps} steps" for level, steps in runs]}
    answers |= {"converged": [False, True, False]}
    for i, (level, steps) in enumerate(runs):
        begin = time.perf_counter()
        body = Moving(folder, level, head)
        prepared = time.perf_counter() - begin
        found = np.array([body.move(load, instants, steps) for load in head["loads"]])
        told = {"displacement_m": found, "nodes_m": body.rest, "triangles": body.surface, "preparation_s": prepared}
        told |= {"seconds": [time.perf_counter() - begin - prepared], "failed": ~np.isfinite(found).all(axis=(1, 2, 3))}
        answers |= {f"setting_{i}/{name}": value for name, value in told.items()}
    np.savez_compressed(out, **answers)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
