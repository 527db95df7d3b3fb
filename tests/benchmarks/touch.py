"""Press rigid instruments into blocks and layers, and compare forces with theory: the table in docs/numerics.md.

    python tests/benchmarks/touch.py

Elements at the touch are halved from row to row: ``a/h`` is how many lie in the contact's radius, ``error`` that of the
force, ``area`` and ``pressure`` those of the contact's area and of its greatest pressure. The exit code is 1 if the
force under Hertz's ball on the finest mesh is more than 0.5 % off. It takes three minutes.
"""

import os
import sys
from pathlib import Path
from time import process_time

from palpate.run.job import kernel_cache

# read when numpy and numba are imported
os.environ |= {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL", "NUMBA")}
os.environ.setdefault("NUMBA_CACHE_DIR", str(kernel_cache()))
sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np
from fixtures.indented_layer import flat, force_at, indented, sphere
from fixtures.pressed_block import DOWN, YOUNG, pressed_block, pressing, stiffness

from palpate.effects.instrument import Instrument

A = 0.1
"""Radius of the contacts [m], about."""


def pressed(name, deep, wide, levels, instrument, depth, expected, poisson=0.3, sticks=False, direction=DOWN, steps=1):
    """Press to ``depth`` [m], print a row, and return the force [N] against ``direction`` and its error."""
    body, top = pressed_block(deep, wide, levels, A, poisson)
    problem, began = pressing(body, levels, top, instrument, 1.3 * A, direction, sticks), process_time()
    found = list(problem.push(direction, depth * np.arange(1, steps + 1) / steps, 1e-5))[-1]
    force = -float(found.force[2])
    print(
        f"{name:42} a/h {A / (deep / 2 ** (levels + 1)):5.1f} nodes {len(problem.mesh.nodes):6} force {force:9.6g} N "
        f"error {force / expected - 1.0:+.4f} along {found.force[0]:+.4g} area {found.area_m2 / (np.pi * A**2):.3f} "
        f"pressure {found.pressure_pa:.4g} Pa overlap {found.overlap:.0e} {process_time() - began:.1f} s",
        flush=True,
    )
    return force, force / expected - 1.0


def main() -> int:
    """Print all rows."""
    hertz = [
        pressed("ball, half-space", 160 * A, 320 * A, levels, Instrument("sphere", 1.0), A**2,
                force_at(sphere(1.0), A**2, YOUNG, 0.3, 160 * A, most=0.5))[1]
        for levels in (7, 8, 9)
    ]  # fmt: skip
    for radius in (0.5, 0.25):
        depth = A**2 / radius
        theory = force_at(sphere(radius), depth, YOUNG, 0.3, 80 * A, most=0.9 * radius)
        pressed(f"ball, a/R = {A / radius:g}", 80 * A, 160 * A, 8, Instrument("sphere", radius), depth, theory)
    for poisson in (0.3, 0.45, 0.49):
        pressed(f"ball, layer of 2 a, nu = {poisson:g}", 2 * A, 12 * A, 3, Instrument("sphere", 10.0), 5e-4,
                force_at(sphere(10.0), 5e-4, YOUNG, poisson, 2 * A, most=0.5), poisson)  # fmt: skip
    theory = indented(flat, A, YOUNG, 0.3, 40 * A, 1e-3).force_n
    for edge in (0.2, 0.1, 0.05, 0.0):
        for levels in (6, 7):
            punch = Instrument("punch", A, edge * A)
            free, _ = pressed(f"punch, edge {edge:g} a", 40 * A, 80 * A, levels, punch, 1e-3, theory)
            if edge == 0.05:
                stuck, _ = pressed("the same, stuck", 40 * A, 80 * A, levels, punch, 1e-3, theory, sticks=True)
                print(f"    stuck over frictionless {stuck / free:.4f}, theory {0.7 * np.log(1.8) / 0.4:.4f}")
    oblique = np.array([0.5, 0.0, -1.0]) / np.sqrt(1.25)
    for steps in (1, 8, 16):
        pressed(f"ball, stuck, oblique, {steps} depths", 40 * A, 80 * A, 6, Instrument("sphere", 1.0), A**2,
                4.0 / 3.0 * stiffness(0.3) * A**3 * 0.8**0.75, sticks=True, direction=oblique, steps=steps)  # fmt: skip
    return int(abs(hertz[-1]) > 0.005)


if __name__ == "__main__":
    sys.exit(main())
