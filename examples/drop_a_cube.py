"""Drop a soft cube on a floor: it falls as Galileo says, and then the floor carries its weight."""

import sys

import numpy as np
import plot

from palpate.bodies.make_body import make_body
from palpate.bodies.particles import particles_of
from palpate.effects.settings import Contact, Floor, Gravity, Rayleigh
from palpate.scenes.run_scene import run
from palpate.scenes.settings import Scene

CUBE = {"kind": "box", "sizes_m": [0.1, 0.1, 0.1], "divisions": [2, 2, 2], "young_pa": 20000.0, "poisson": 0.3}
CUBE |= {"density_kg_m3": 1000.0, "anchors": {"plane": {"axis": "z", "side": "min", "depth_m": 0.001}}}
ACTING = {"gravity": Gravity(acceleration_m_s2=[0, 0, -9.81]), "contact": Contact(instruments=[Floor(height_m=-0.05)])}
SCENE = Scene(body="cube", held=False, step_s=0.005, duration_s=0.6, frames=120, rayleigh=Rayleigh(), **ACTING)


def main(picture=None):
    """Return when the cube lands [s], and the force on the floor at the end over the cube's weight."""
    cube = particles_of(make_body("cube", CUBE), level=0, surface=False)
    motion = run(SCENE, cube).motion
    height = 1e3 * motion.positions[..., 2].min(axis=1) + 50
    time, force = motion.observed["time_s"].values, -motion.observed["floor_0_force_z_n"].values
    weight = 9.81 * cube.masses.sum()
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
