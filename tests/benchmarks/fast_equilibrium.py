"""Time presses of quadratic elements by L-BFGS against Newton's method, on the shipped liver.

    python tests/benchmarks/fast_equilibrium.py [LEVEL]

On LEVEL (default 1). The exit code is 1 if L-BFGS is not faster.
"""

import sys
from time import process_time

import numpy as np
from fused_kernel import press, shipped_liver

from palpate.solvers.equilibrium import Equilibrium, FastEquilibrium


def main() -> None:
    level = int(sys.argv[1]) if sys.argv[1:] else 1
    body = shipped_liver(level + 1)
    load, seconds, found = press(body, level + 1), {}, {}
    print("method,solve_s,iterations,products,residual")
    for name, kind in (("newton", Equilibrium), ("lbfgs", FastEquilibrium)):
        problem = kind(body, level, 2)
        problem.solve(load, 1e-2)  # compiles
        begin = process_time()
        solution = problem.solve(load, 1e-6)
        seconds[name], found[name] = process_time() - begin, solution.x - problem.mesh.nodes
        print(f"{name},{seconds[name]:.3g},{solution.iterations},{solution.products},{solution.history[-1]:.1e}")
    apart = np.abs(found["lbfgs"] - found["newton"]).max() / np.abs(found["newton"]).max()
    ratio = seconds["newton"] / seconds["lbfgs"]
    print(f"newton over lbfgs,{ratio:.2f}\nlargest difference over peak,{apart:.1e}")
    sys.exit("L-BFGS is slower than Newton's method" if ratio < 1.0 else 0)


if __name__ == "__main__":
    main()
