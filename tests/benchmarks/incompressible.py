"""Measure what elements miss, and what solves cost, as Poisson's ratio tends to 1/2: the table in docs/numerics.md.

    python tests/benchmarks/incompressible.py [FINEST] [NU ...]

The bedded liver of config.deep.yaml is pressed by a disc of 12 mm, 2 % of its length deep. The limit is Richardson's,
from levels 1 to FINEST (default 3, which takes 5 GB and minutes a ratio) of mean dilatation. Errors are RMSE over the
surface nodes of level 1 as a share of the limit's peak; ``missing`` is the part of the limit's work that the load does
not do; ``volume`` is the RMS over elements of mean det F − 1, and ``products`` are the steps of conjugate gradients to
1e-8 at rest. With less than three levels, the finest is taken for the limit. The exit code is 1 if mean dilatation on
level 2 misses more than 1.2 %.
"""

import os
import sys
from time import process_time

from palpate.bodies.settings import Liver
from palpate.run.job import kernel_cache

# read when numpy and numba are imported
os.environ |= {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL", "NUMBA")}
os.environ.setdefault("NUMBA_CACHE_DIR", str(kernel_cache()))

import numpy as np

from palpate.benchmark.richardson import limit, ratio
from palpate.bodies.body import Body
from palpate.bodies.make_body import make_body
from palpate.bodies.refinement import finer, quadratic_prolongation
from palpate.effects import elements
from palpate.effects.patch_load import patch_at, spread
from palpate.effects.quadratic_elements import QuadraticElements
from palpate.linalg.multigrid import conjugate_gradients
from palpate.solvers import equilibrium
from palpate.solvers.equilibrium import Equilibrium

BED = {"sphere": {"center_m": [-0.05, 0.05, 0.03], "radius_m": 0.06}, "stiffness_n_m3": 400000}
LIVER = Liver(length_m=0.2, smooth=True, refinements=2, young_pa=3000, poisson=0.3)
RADIUS_M, DEPTH_M, MOST = 0.012, 0.004, 0.012
RATIOS = (0.3, 0.45, 0.49, 0.499, 0.4999)


def mean_det(elasticity: QuadraticElements, x: np.ndarray) -> np.ndarray:
    """Return det F of each element, its mean over the points, (n_elements,)."""
    places, total = x[elasticity.couples], np.zeros(len(elasticity.volumes))
    for slopes in elasticity._slopes:
        f = np.einsum("eai,ac,ecj->eij", places, slopes, elasticity.gradients[:, 1:], optimize=True)
        total += np.linalg.det(f) / len(elasticity._slopes)
    return total


def answers(body: Body, whole: Body, order: int, plain: bool, levels: range, newtons: float) -> list[dict]:
    """Press on each of ``levels``, each started from the one before; ``plain`` keeps elements that may lock."""
    equilibrium.PLAIN_POISSON = 0.5 if plain else elements.PLAIN_POISSON
    found, start = [], None
    contact = farthest(body)
    for level in levels:
        began = process_time()
        problem, mesh = Equilibrium(whole, level, order), whole.levels[level]
        patch = patch_at(body, contact, RADIUS_M)
        load = spread(mesh, patch, -newtons * patch.normal, order)
        row = {"level": level, "nodes": len(problem.mesh.nodes), "setup_s": process_time() - began, "products": 0}
        if level < 3:
            row["products"] = conjugate_gradients(*problem.linearise(problem.mesh.nodes), load, 1e-8, 3000)[1]
        began = process_time()
        solution = problem.solve(load, 1e-4 if start is None else 1e-3, start)
        moved = solution.x - problem.mesh.nodes
        row |= {"solve_s": process_time() - began, "newton": solution.iterations, "steps": solution.products}
        row |= {"surface": moved[body.levels[1].surface], "work": float(np.vdot(load, moved)), "volume": np.nan}
        if order == 2:
            row["volume"] = float(np.sqrt(np.mean((mean_det(problem._elasticity, solution.x) - 1.0) ** 2)))
        found.append(row)
        if level < levels[-1]:
            up = quadratic_prolongation(mesh, whole.levels[level + 1]) if order == 2 else whole.prolongations[level]
            rest = whole.levels[level + order].nodes
            start = rest + up @ moved
    return found


def farthest(body: Body) -> int:
    """The coarse surface node farthest from the bed."""
    surface = body.coarse.surface
    return int(surface[np.argmax(np.linalg.norm(body.coarse.nodes[surface] - BED["sphere"]["center_m"], axis=1))])


def force_of(body: Body, whole: Body) -> float:
    """The force [N] that presses DEPTH_M deep at ν = 0.3 in the linear answer of level 1."""
    patch, problem = patch_at(body, farthest(body), RADIUS_M), Equilibrium(whole, 1, 2)
    load = spread(whole.levels[1], patch, -patch.normal, 2)
    return DEPTH_M / float(np.linalg.norm(problem.linear_solver(1e-6)(load), axis=1).max())


def main() -> None:
    finest = int(sys.argv[1]) if sys.argv[1:] else 3
    failed, newtons = [], 0.0
    print("nu,elements,level,nodes,error_%,missing_%,volume_1e-3,products,newton,steps,solve_s,ratio")
    for nu in [float(each) for each in sys.argv[2:]] or RATIOS:
        body = make_body("liver", LIVER.but(poisson=nu, bed=BED))
        whole = finer(body, finest - 1)
        newtons = newtons or force_of(body, whole)
        mean = answers(body, whole, 2, False, range(1, finest + 1), newtons)
        levels = np.array([each["surface"] for each in mean])
        truth, rate = (limit(levels), ratio(levels)) if len(levels) > 2 else (levels[-1], np.nan)
        work = mean[-1]["work"]
        if len(mean) > 2:
            work += (mean[-1]["work"] - mean[-2]["work"]) / (rate - 1.0)
        peak = float(np.linalg.norm(truth, axis=1).max())
        rows = {"mean": mean, "plain": answers(body, whole, 2, True, range(1, 3), newtons) if nu > 0.45 else []}
        rows["linear"] = answers(body, whole, 1, False, range(1, 4), newtons)
        for name, each in ((name, each) for name, found in rows.items() for each in found):
            error = float(np.sqrt(np.mean(np.sum((each["surface"] - truth) ** 2, axis=1)))) / peak
            said = f"{100 * error:.3f},{100 * (1 - each['work'] / work):.2f},{1e3 * each['volume']:.3f}"
            cost = f"{each['products']},{each['newton']},{each['steps']},{each['solve_s']:.2f}"
            print(f"{nu:g},{name},{each['level']},{each['nodes']},{said},{cost},{rate:.2f}", flush=True)
            if name == "mean" and each["level"] == 2 and error > MOST:
                failed.append(f"{100 * error:.2f} % at {nu:g}")
    sys.exit(f"mean dilatation misses {', '.join(failed)}, more than {100 * MOST} %" if failed else 0)


if __name__ == "__main__":
    main()
