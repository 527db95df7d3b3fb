"""Time the loop composed from a scene's blocks against one written by hand for just these effects.

`make bench` runs this in the project's folder. Both loops must end at the same positions to the bit, and the composed
one may take RATIO times as long at most; else the exit code is 1.
"""

import os
import sys
from collections.abc import Callable
from pathlib import Path
from statistics import median
from time import process_time

from palpate.run.job import kernel_cache

# read when numpy and numba are imported
os.environ |= {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL", "NUMBA")}
os.environ["NUMBA_CACHE_DIR"] = str(kernel_cache())

import numpy as np
from by_hand import cube_poke, liver_press
from snakemake.utils import update_config

from palpate.bodies.make_body import make_body
from palpate.bodies.particles import Particles, particles_of
from palpate.run.settings import complete, read_settings
from palpate.scenes import effect_registry
from palpate.scenes.run_scene import compose, loop
from palpate.scenes.settings import Scene

ROOT = Path(__file__).parents[2]
RATIO, BUDGET_S, LEAST = 1.1, 3.0, 5
"""The largest ratio allowed; time spent on pairs of runs of each scene, and how many there are at least."""
SCENES = {"liver_press": (liver_press, 12), "cube_poke": (cube_poke, 500)}
"""The loop of each scene by hand, and how many of its steps are timed."""


class Last:
    """Where ``loop`` leaves its positions: neither loop keeps frames or sums energies."""

    def __init__(self, x: np.ndarray):
        self.x, self.seconds = x.copy(), []

    def after(self, step, x, v):
        self.last = x


def composed(scene: Scene, particles: Particles) -> Callable[[], np.ndarray]:
    system = compose(scene, particles)
    integrator = effect_registry.integrator(scene.integrator).make(system, scene)

    def steps():
        record = Last(particles.nodes)
        loop(system, integrator, scene, record, iter)
        return record.last

    return steps


def timed(make: Callable, scene: Scene, particles: Particles) -> tuple[float, np.ndarray]:
    """Processor time [s] of the steps, which other processes on the machine do not add to, and where they end."""
    steps = make(scene, particles)
    start = process_time()
    x = steps()
    return process_time() - start, x


def compare(scene: Scene, particles: Particles, by_hand: Callable) -> tuple[float, float, float]:
    """Medians of both times a step [ms] and of their ratio, over runs in alternating order; the first pair compiles."""
    pairs, spent = [], 0.0
    while len(pairs) <= LEAST or spent < BUDGET_S:
        order = (composed, by_hand) if len(pairs) % 2 else (by_hand, composed)
        found = {make: timed(make, scene, particles) for make in order}
        (one, x), (other, y) = found[composed], found[by_hand]
        if not np.array_equal(x, y):
            sys.exit(f"{scene.name}: the loops end {np.abs(x - y).max():.1e} m apart; they must agree to the bit")
        pairs.append((one, other))
        spent += one + other if len(pairs) > 1 else 0.0
    ones, others = zip(*pairs[1:], strict=True)
    ratio = median(one / other for one, other in pairs[1:])
    return 1e3 * median(ones) / scene.steps, 1e3 * median(others) / scene.steps, ratio


def main() -> None:
    config = read_settings(ROOT / "config.yaml")
    update_config(config, read_settings(ROOT / "config.full.yaml"))
    config = complete(config, ROOT / "config.yaml")
    print("scene,composed_ms_per_step,hand_written_ms_per_step,ratio")
    worst = 0.0
    for name, (by_hand, steps) in SCENES.items():
        scene = config.scenes[name]
        scene = scene.but(name=name, duration_s=steps * scene.step_s)
        particles = particles_of(make_body(scene.body, config.bodies[scene.body]), scene.level, scene.surface)
        one, other, ratio = compare(scene, particles, by_hand)
        print(f"{name},{one:.4g},{other:.4g},{ratio:.3f}", flush=True)
        worst = max(worst, ratio)
    sys.exit(f"the composed loop takes {worst:.2f} times as long, more than {RATIO}" if worst > RATIO else 0)


if __name__ == "__main__":
    main()
