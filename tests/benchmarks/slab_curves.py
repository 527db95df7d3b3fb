"""Measure the axisymmetric curves against elements in three dimensions: python -m tests.benchmarks.slab_curves.

Blocks are pressed on the meshes of the truth of touch, two levels of them. Printed are the force of both over the
axisymmetric force, and what halving the elements leaves by extrapolation of order 2.
"""

import sys
from time import perf_counter

import numpy as np

from palpate.benchmark.touch import Touch
from palpate.benchmark.touch_mesh import TouchedMeshes
from palpate.bodies.body import nest
from palpate.bodies.material import Material
from palpate.bodies.simple_shapes import box
from palpate.effects.instrument import Instrument
from palpate.identification.axisymmetric_indentation import BallOnSlab

DEPTHS = (0.25, 0.5, 0.75)
CASES = [
    ("neo_hookean", 0.3, 2.5, False),
    ("neo_hookean", 0.45, 2.5, False),
    ("neo_hookean", 0.3, 2.5, True),
    ("corotational", 0.3, 2.5, False),
]


def main() -> None:
    for law, poisson, thickness, sticks in CASES:
        side, across = 4.0 * thickness, 4
        mesh = box([side, side, thickness], [across, across, 1])
        held = np.flatnonzero(mesh.nodes[:, 2] == 0.0)
        body = nest("block", mesh, 1, held, Material(1.0, poisson, 1000.0, law))
        top = np.linalg.norm(body.fine.nodes - [0.5 * side, 0.5 * side, thickness], axis=1).argmin()
        touch = Touch(Instrument("sphere", 1.0, sticks=sticks), int(top), np.array([0.0, 0.0, -1.0]), DEPTHS[-1])
        curve = BallOnSlab(law, poisson, thickness, sticks).curve(DEPTHS[-1])
        meshes, shares = TouchedMeshes(body), []
        for level in (3, 4):
            begin = perf_counter()
            found = meshes.around(touch, 2, level)
            states = list(found.problem.push(touch.direction, DEPTHS, 1e-4))
            forces = np.array([state.force @ touch.direction for state in states])
            shares.append(forces / curve.at(np.array(DEPTHS)))
            said = f"{law} nu {poisson} h {thickness} {'sticks' if sticks else 'slips'} edge {found.edge_m:.3g}"
            print(f"{said}: {np.round(shares[-1], 4)}, {perf_counter() - begin:.0f} s", flush=True)
        print(f"  limit {np.round(shares[1] + (shares[1] - shares[0]) / 3.0, 4)}", flush=True)


if __name__ == "__main__":
    sys.exit(main())
