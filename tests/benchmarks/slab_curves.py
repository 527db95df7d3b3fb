"""Measure the axisymmetric curves against the truth of touch on blocks: python -m tests.benchmarks.slab_curves.

Prints, for each law, Poisson's ratio and depth, the truth's own error and how far the axisymmetric force is off it.
"""

import sys
import warnings

import numpy as np

from palpate.benchmark.touch import Touch
from palpate.benchmark.touch_truth import Asked, TouchErrors, truth_of_touches
from palpate.bodies.body import nest
from palpate.bodies.material import Material
from palpate.bodies.simple_shapes import box
from palpate.effects.instrument import Instrument
from palpate.errors import NotConverged
from palpate.solvers.axisymmetric_indentation import BallOnSlab

DEPTHS = (0.25, 0.5, 0.75)
CASES = [
    ("neo_hookean", 0.3, 2.5, False),
    ("neo_hookean", 0.45, 2.5, False),
    ("stable_neo_hookean", 0.3, 2.5, False),
    ("corotational", 0.3, 2.5, False),
    ("neo_hookean", 0.3, 5.0, False),
    ("neo_hookean", 0.3, 2.5, True),
]


def main() -> None:
    for law, poisson, thickness, sticks in CASES:
        across = 2 * round(6.0 / thickness * 2)
        side = across * thickness / 2.0
        mesh = box([side, side, thickness], [across, across, 2])
        held = np.flatnonzero(mesh.nodes[:, 2] == 0.0)
        body = nest("block", mesh, 0, held, Material(1.0, poisson, 1000.0, law))
        top = np.linalg.norm(body.fine.nodes - [0.5 * side, 0.5 * side, thickness], axis=1).argmin()
        ball, down = Instrument("sphere", 1.0, sticks=sticks), np.array([0.0, 0.0, -1.0])
        touches = [Touch(ball, int(top), down, depth) for depth in DEPTHS]
        truth = truth_of_touches(body, touches, asked=Asked(finest=2))
        for row, depth in enumerate(DEPTHS):
            try:
                curve = BallOnSlab(law, poisson, thickness, sticks).curve(depth)
                off = curve.at(depth) / truth.force[row, 1] - 1.0
            except NotConverged as failure:
                off, _ = np.nan, print(failure)
            own = TouchErrors(*truth.own[row]).force_error
            said = f"{law} nu {poisson} h {thickness} {'sticks' if sticks else 'slips'} depth {depth}"
            force, seconds = truth.force[row, 1], truth.seconds[row]
            print(f"{said}: truth {force:.5f} own error {own:.2%}, off {off:+.2%}, {seconds:.0f} s", flush=True)


if __name__ == "__main__":
    warnings.simplefilter("always")
    sys.exit(main())
