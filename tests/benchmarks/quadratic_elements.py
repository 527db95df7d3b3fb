"""Time solves with quadratic elements against linear ones on the same nodes, and list what finer levels take.

    python tests/benchmarks/quadratic_elements.py [FINEST]

Each level of quadratic elements, 1 to FINEST (default 2; 3 takes 3 GB), starts from the answer on the level below. The
exit code is 1 if a solve on level 1 takes more than three times as long as one with linear elements on level 2.
"""

import os
import resource
import sys
from pathlib import Path
from time import process_time

from palpate.run.job import kernel_cache

# read when numpy and numba are imported
os.environ |= {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL", "NUMBA")}
os.environ["NUMBA_CACHE_DIR"] = str(kernel_cache())
sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np
from fixtures.bodies import made

from palpate.bodies.body import Body
from palpate.bodies.refinement import quadratic_prolongation
from palpate.files import read_yaml
from palpate.solvers.equilibrium import Equilibrium

ROOT = Path(__file__).parents[2]
SHAPE = {"kind", "length_m", "refinements", "young_pa", "poisson", "density_kg_m3", "anchors"}
FORCE_N, RADIUS_M, MOST = 0.05, 0.012, 3.0


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


def solve_ms(body: Body) -> float:
    """Least processor time of a solve with linear elements on the finest level [ms]; the first one may compile."""
    level, times = len(body.levels) - 1, []
    problem, load = Equilibrium(body, level), press(body, level)
    for _ in range(6):
        begin = process_time()
        problem.solve(load, 1e-8)
        times.append(process_time() - begin)
    return 1e3 * min(times[1:])


def megabytes() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def main() -> None:
    finest = int(sys.argv[1]) if sys.argv[1:] else 2
    linear_ms = solve_ms(shipped_liver())
    body = shipped_liver(finest + 1)
    Equilibrium(body, 0, 2).solve(press(body, 1), 1e-8)  # compiles
    print("elements,level,nodes,setup_s,solve_s,newton,products,least_det,peak_mb")
    print(f"linear,2,{len(body.levels[2].nodes)},,{1e-3 * linear_ms:.3g},,,,")
    start, level_1_s = None, 0.0
    for level in range(1, finest + 1):
        begin = process_time()
        problem = Equilibrium(body, level, 2)
        setup_s, load = process_time() - begin, press(body, level + 1)
        begin = process_time()
        solution = problem.solve(load, 1e-8, start)
        seconds = process_time() - begin
        level_1_s = level_1_s or seconds
        cost = f"{setup_s:.3g},{seconds:.3g},{solution.iterations},{solution.products}"
        nodes = len(problem.mesh.nodes)
        print(f"quadratic,{level},{nodes},{cost},{problem.least_det(solution.x):.3f},{megabytes():.0f}", flush=True)
        if level < finest:
            finer = quadratic_prolongation(body.levels[level], body.levels[level + 1])
            start = body.levels[level + 2].nodes + finer @ (solution.x - problem.mesh.nodes)
    ratio = 1e3 * level_1_s / linear_ms
    print(f"ratio on the same nodes,{ratio:.2f}")
    sys.exit(f"a quadratic solve takes {ratio:.2f} times as long, more than {MOST}" if ratio > MOST else 0)


if __name__ == "__main__":
    main()
