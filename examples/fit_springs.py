"""Fit springs to a pressed cube of finite elements, by the gradient of an adjoint (the cube of paper 2)."""

import sys

import numpy as np
import plot

from palpate.bodies.body import nest
from palpate.bodies.material import Material
from palpate.bodies.particles import particles_of
from palpate.models.springs.cube_experiment import middle, paper_cube
from palpate.models.springs.descent import descend
from palpate.models.springs.fitness import Fitness, Range
from palpate.models.springs.spring_motion import Press, Settings, key_points, reference_motion, simulate, spring_model


def main(picture=None):
    """Return the errors of springs of the material's own modulus and of the fitted ones, RMSE over peak."""
    mesh = paper_cube(0.01)  # 10 mm; 120 nodes, 590 springs
    body = nest("cube", mesh, 0, np.flatnonzero(mesh.nodes[:, 2] == 0.0), Material(1000.0, 0.3, 1000.0))
    cube, (node, inward) = particles_of(body, level=0, surface=False), middle(mesh, "top")
    press, top = Press("top", node, 0.001 * inward, rise_s=0.02), mesh.nodes[mesh.nodes[:, 2] == 0.01]
    settings = Settings(0.0005, 80, damping_ratio=0.1, keys=key_points(mesh.nodes, mesh.tetrahedra, top))
    springs, given = spring_model(cube), np.full(120, 1000.0)  # a modulus a node [Pa]
    wanted, speeds = reference_motion(cube, springs, press, settings, substeps=1)  # (steps, points, 3) [m], [m/s]
    fitted = descend([Fitness(springs, press, settings, wanted, speeds)], given, Range(300.0, 3000.0), 40)[0].young

    found = [simulate(springs, young, press, settings)[0] for young in (given, fitted)]
    way = [np.linalg.norm(motion - top, axis=2) for motion in (wanted, *found)]
    if picture:
        names, time = ["finite elements", "springs of 1000 Pa", "fitted springs"], 0.5 * np.arange(1, 81)
        motions = {name: (time, 1e3 * each.max(axis=1)) for name, each in zip(names, way, strict=True)}
        plot.curves(picture, [("time [ms]", "largest displacement [mm]", motions)])
    return [np.sqrt(((motion - wanted) ** 2).sum(axis=2).mean()) / way[0].max() for motion in found]


if __name__ == "__main__":
    print("error {:.3f} of the peak, and of the fitted springs {:.3f}".format(*main(*sys.argv[1:])))
