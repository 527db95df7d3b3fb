"""Drop a soft cube on a floor: it falls as Galileo says, and then the floor carries its weight."""

import sys

import numpy as np
import plot

import palpate as pp

CUBE = pp.Box(sizes_m=(0.1, 0.1, 0.1), divisions=(2, 2, 2), young_pa=20000, poisson=0.3)
FLOOR = pp.Contact(instruments=[pp.Floor(height_m=-0.05)])


def main(picture=None):
    """Return when the cube lands [s], and the force on the floor at the end over the cube's weight."""
    effects = [pp.Gravity(), FLOOR, pp.Rayleigh()]
    motion = pp.simulate(CUBE, effects, step_s=0.005, duration_s=0.6, frames=120)
    height = 1e3 * motion.positions[..., 2].min(axis=1) + 50
    time, force, weight = motion.observed["time_s"].values, motion.force("floor")[:, 2], 9.81 * 1000 * 0.1**3
    if picture:
        fall = np.maximum(50 - 4905 * motion.times**2, 0)
        heights = {"50 mm − ½ g t²": (motion.times, fall), "lowest node": (motion.times, height)}
        forces = {"weight": (time, np.full_like(time, weight)), "force on the floor": (time, force)}
        panels = ("time [s]", "height over the floor [mm]", heights), ("time [s]", "force [N]", forces)
        plot.curves(picture, panels)
    return time[force > 0][0], force[-1] / weight


if __name__ == "__main__":
    landed, carried = main(*sys.argv[1:])
    print(f"lands after {landed:.3f} s; then the floor carries {carried:.4f} of the weight")
