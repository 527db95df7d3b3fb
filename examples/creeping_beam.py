"""Load the tip of a silicone beam and let it go: it yields at once, creeps on, and comes back as slowly."""

import sys

import numpy as np
import plot

from palpate.bodies.make_body import make_body
from palpate.bodies.particles import particles_of
from palpate.effects.settings import Load, Prony, Push, Rayleigh
from palpate.scenes.run_scene import run
from palpate.scenes.settings import Scene

BEAM = {"kind": "box", "sizes_m": [0.12, 0.02, 0.02], "divisions": [12, 2, 2], "young_pa": 2e5, "poisson": 0.4}
BEAM |= {"density_kg_m3": 1000.0, "anchors": {"plane": {"axis": "x", "side": "min", "depth_m": 0.001}}}
SHARE, TIME_S = 0.3, 0.4  # part of the first shear modulus, and the time in which it relaxes to the last one
LOAD = Load(at_m=[0.12, 0.01, 0.02], force_n=[0, 0, -0.02], radius_m=0.01, press_s=0.04, hold_s=1.96, release_s=0.04)
YIELDING = {"prony": Prony(shares=[SHARE], times_s=[TIME_S]), "rayleigh": Rayleigh(mass_1_s=20.0, stiffness_s=0.0)}
SCENE = Scene(body="beam", step_s=0.02, duration_s=4.0, frames=200, push=Push(loads=[LOAD]), **YIELDING)


def creep(t):
    """Return the part of the last deflection that is reached under a load ``t`` [s] old."""
    bends = SHARE * 2 * (1 + BEAM["poisson"]) / 3  # the bulk modulus does not relax
    return (t > 0) * (1 - bends * np.exp(-np.maximum(t, 0) * (1 - SHARE) / TIME_S))


def main(picture=None):
    """Return the largest difference from the theory, from 0.4 s after load and release on, over the last deflection."""
    beam = particles_of(make_body("beam", BEAM), level=0, surface=False)
    motion = run(SCENE, beam).motion
    t, tip = motion.times, 1e3 * (motion.rest - motion.positions)[:, beam.nodes[:, 0] > 0.119, 2].mean(axis=1)
    theory = (creep(t - 0.02) - creep(t - 2.02)) * tip[t < 2][-1] / creep(2.0)
    if picture:
        plot.curves(picture, [("time [s]", "deflection [mm]", {"theory": (t, theory), "beam": (t, tip)})])
    return np.abs(tip - theory)[(t % 2.0) > 0.4].max() / theory.max()


if __name__ == "__main__":
    print(f"creeps and returns within {main(*sys.argv[1:]):.2%} of the theory")
