"""Time solves with quadratic elements against linear ones on the same nodes, and list what finer levels take.

    python tests/benchmarks/quadratic_elements.py [FINEST]

Each level of quadratic elements, 1 to FINEST (default 2; 3 takes 3 GB), starts from the answer on the level below. The
exit code is 1 if a solve on level 1 takes more than three times as long as one with linear elements on level 2.
"""

import resource
import sys
from time import process_time

from fused_kernel import press, shipped_liver, solve_ms

from palpate.bodies.refinement import quadratic_prolongation
from palpate.solvers.equilibrium import Equilibrium

MOST = 3.0


def megabytes() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def main() -> None:
    finest = int(sys.argv[1]) if sys.argv[1:] else 2
    linear_ms, _ = solve_ms(shipped_liver())
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
