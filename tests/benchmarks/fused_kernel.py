"""Time the kernels of linear corotational elements, and a solve with them, against decomposing every element.

    python tests/benchmarks/fused_kernel.py

The second of each two columns is a plain pass over the elements with a singular value decomposition of each F, energy
and force apart, as is the fallback of the kernels. The exit code is 1 if the answers differ, or if the solve is less
than twice as fast.
"""

import os
import sys
from collections.abc import Callable
from pathlib import Path
from time import process_time

from palpate.run.job import kernel_cache

# read when numpy and numba are imported
os.environ |= {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL", "NUMBA")}
os.environ["NUMBA_CACHE_DIR"] = str(kernel_cache())

import numba
import numpy as np
from fixtures.bodies import made

from palpate.bodies.body import Body
from palpate.effects import linear_elements
from palpate.files import read_yaml
from palpate.solvers import equilibrium
from palpate.solvers.equilibrium import Equilibrium

ROOT = Path(__file__).parents[2]
SHAPE = {"kind", "length_m", "refinements", "young_pa", "poisson", "density_kg_m3", "anchors"}
FORCE_N, RADIUS_M, LEAST = 0.05, 0.012, 2.0


def shipped_liver(refinements: int = 2) -> Body:
    """The liver of config.yaml, plain midpoints."""
    entry = read_yaml(ROOT / "config.yaml")["bodies"]["liver"]
    return made("liver", {k: v for k, v in entry.items() if k in SHAPE} | {"refinements": refinements})


def press(body: Body, level: int) -> np.ndarray:
    """A parabolic pressure on the nodes of ``level``, at the coarse node farthest from the anchors."""
    mesh, coarse = body.levels[level], body.coarse
    away = np.linalg.norm(coarse.nodes[coarse.surface] - coarse.nodes[body.anchors[0]].mean(axis=0), axis=1)
    contact = coarse.surface[np.argmax(away)]
    distance = np.linalg.norm(mesh.nodes - mesh.nodes[contact], axis=1)
    shares = mesh.areas * np.maximum(0.0, 1.0 - (distance / RADIUS_M) ** 2)
    return np.outer(shares / shares.sum(), -FORCE_N * coarse.normals[contact])


def best(function: Callable, repeats: int = 5) -> float:
    """Least processor time of a call [ms]; the first one, which may compile, does not count."""
    times = []
    for _ in range(repeats + 1):
        start = process_time()
        function()
        times.append(process_time() - start)
    return 1e3 * min(times[1:])


def by_decomposition(elastic: type) -> type:
    """The same elements, every one decomposed, by kernels that are compiled here."""
    from palpate.effects import linear_elements
    from palpate.effects.corotational import BLOCK, _principal_blocks, _principal_stress

    @numba.njit(error_model="numpy")
    def stresses(f, p, count, mu, lam, energies, sure):
        for k in range(count):
            energies[k] = _principal_stress(f, p, k, mu[k], lam[k])

    @numba.njit(error_model="numpy")
    def hessians(f, gradients, shares, count, mu, lam, definite, rotated, blocks):
        scratch = np.empty((7, 3, 3))
        for k in range(count):
            _principal_blocks(f, gradients, shares[k], k, mu[k], lam[k], definite, scratch, blocks)

    def recompiled(function):
        names = vars(linear_elements) | {"stresses": stresses, "hessians": hessians, "BLOCK": BLOCK}
        plain = type(function.py_func)(function.py_func.__code__, names)
        return numba.njit(error_model="numpy")(plain)

    force, stiffness = recompiled(linear_elements.energy_and_force), recompiled(linear_elements.add_stiffness)

    class Decomposed(elastic):
        def evaluate(self, x, out):
            return force(x, self.tetrahedra, self.gradients, self.volumes, *self.moduli, *self.law, out)

        def energy(self, x):
            return self.evaluate(x, np.zeros_like(x))

        def force(self, x):
            out = np.zeros_like(x)
            self.evaluate(x, out)
            return out

        def add_stiffness(self, x, definite, slots, values):
            stiffness(
                x, self.tetrahedra, self.gradients, self.volumes, *self.moduli, *self.law, definite, slots, values
            )

    return Decomposed


def solve_ms(body: Body) -> tuple[float, np.ndarray]:
    """Time of a solve on the finest level, and its answer."""
    level = len(body.levels) - 1
    problem, load = Equilibrium(body, level), press(body, level)
    return best(lambda: problem.solve(load, 1e-8)), problem.solve(load, 1e-8).x


def main() -> None:
    body = shipped_liver()
    fused = linear_elements.LinearElements
    decomposed = by_decomposition(fused)
    found, plain = (kind(body.fine, body.material) for kind in (fused, decomposed))
    ms, x = solve_ms(body)
    equilibrium.LinearElements = decomposed
    plain_ms, y = solve_ms(body)
    equilibrium.LinearElements = fused
    rows = {
        "energy and force": (
            lambda: (found.forget(), found.energy(x), found.force(x)),
            lambda: (plain.energy(x), plain.force(x)),
        ),
        "stiffness": (lambda: found.stiffness(x), lambda: plain.stiffness(x)),
        "definite stiffness": (lambda: found.stiffness(x, True), lambda: plain.stiffness(x, True)),
    }
    times = {name: (best(one), best(other)) for name, (one, other) in rows.items()} | {"solve": (ms, plain_ms)}
    print("what,ms,decomposed_ms,ratio")
    for name, (one, other) in times.items():
        print(f"{name},{one:.3g},{other:.3g},{other / one:.2f}", flush=True)
    ratio = plain_ms / ms
    apart = np.abs(x - y).max() / np.abs(x - body.fine.nodes).max()
    if apart > 1e-6:
        sys.exit(f"the answers are {apart:.1e} of the largest displacement apart")
    sys.exit(f"the solve is {ratio:.2f} times as fast, less than {LEAST}" if ratio < LEAST else 0)


if __name__ == "__main__":
    main()
