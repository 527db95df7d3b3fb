"""Hard cases of contact that begin with an overlap: refused, or pushed out where the scene asks for it."""

import numpy as np

from palpate.bodies.box import box
from palpate.bodies.particles import merge_particles, solid_particles
from palpate.studies.hard_cases.contact_cases import ALL, SIZE_M, SOLIDS, block, pairs_of, played, solid
from palpate.studies.hard_cases.contact_measures import MEETS, NEAR, clears, frames, meets
from palpate.studies.hard_cases.hard_case import Answer, Case
from palpate.studies.hard_cases.stage import FIRM

OFF_BALL = "least distance of the body from the ball / its radius; 1 and more inside it"
OFF = 0.01
"""Distance at which a body counts as touching the ball, in its radii."""
STILL = {"gravity": {"acceleration_m_s2": [0.0, 0.0, 0.0]}}


def cases() -> list[Case]:
    """Return the declared cases of this family."""

    def case(name, scene, expected, run, models, measure=MEETS, declared=None):
        words = (name, "contact", "palpate", scene, expected, measure, NEAR if measure == MEETS else OFF)
        return Case.of(*words, run=run, models=models, declared=declared)

    refused = {"shared_check": ("refused",)}
    boxes = [[0.0, 0.0, 0.0], [0.0, 0.0, 0.05]]
    return [
        case("deep_in_each_other", "two boxes start half inside each other", "refused: no direction of separation",
             lambda model: _separated("fem_implicit", boxes, False), ("shared_check",), "none", refused),
        case("instrument_inside", "a ball starts in the middle of a body", "refused",
             lambda model: _swallowed("fem_implicit", push_out=False), ("shared_check",), "none", refused),
        case("pushed_out_of_each_other", "two boxes start half inside each other, with push_out: true",
             "they are moved apart until they just do not touch", lambda model: _separated(model, boxes, True), ALL),
        case("pushed_out_of_three", "three boxes start inside each other, with push_out: true", "they are moved apart",
             lambda model: _separated(model, [*boxes, [0.06, 0.01, 0.02]], True), ALL),
        case("pushed_out_of_instrument", "a ball starts in the middle of a free body, with push_out: true",
             "the body is moved off the ball", _swallowed, ALL, OFF_BALL),
        case("dented_by_instrument", "a ball starts in the upper side of a held body, with push_out: true",
             "the surface is pressed in", _dented, SOLIDS, OFF_BALL),
    ]  # fmt: skip


def _separated(model: str, shifts: list[list[float]], push_out: bool) -> Answer:
    """Begin with blocks that overlap, without gravity; frozen is the start that the scene describes."""
    particles = merge_particles([solid(block(), False)] * len(shifts), shifts, "hard_case")
    found = frames(played(model, particles, 0.02, STILL, push_out=push_out))
    pairs = pairs_of(particles, [(i, j) for i in range(len(shifts)) for j in range(i)])

    def error(a: np.ndarray) -> float:
        """Measure as ``meets``, where one pair has to be near."""
        each = [meets([pair], SIZE_M)(a) for pair in pairs]
        return max(each) if max(each) > 1.0 else min(each)

    return Answer(found, particles.nodes, error)


def _swallowed(model: str, push_out: bool = True) -> Answer:
    """Begin with a ball inside a block, without gravity."""
    ball = {"kind": "sphere", "center_m": [0.05, 0.05, 0.05], "radius_m": 0.02}
    particles = solid(block(), False)
    found = frames(played(model, particles, 0.02, STILL, instruments=[ball], push_out=push_out))
    center = np.array([0.05, 0.05, 0.05])

    def error(a: np.ndarray) -> float:
        """Measure the distance of the block, which stays a block, from the ball."""
        low, high = a[:, :, :].min(axis=1), a.max(axis=1)
        beyond = np.linalg.norm(center - np.clip(center, low, high), axis=1).min() / 0.02 - 1.0
        return float(beyond if beyond >= 0.0 else 1.0 - beyond)

    return Answer(found, particles.nodes, error)


def _dented(model: str) -> Answer:
    """Begin with a ball that reaches 5 mm into the upper side of a block, which stands on a held side."""
    mesh = box([0.1, 0.1, 0.1], [4, 4, 4])
    particles = solid_particles(mesh, np.flatnonzero(mesh.nodes[:, 2] == 0.0), FIRM, "body")
    center = np.array([0.05, 0.05, 0.115])
    ball = {"kind": "sphere", "center_m": center.tolist(), "radius_m": 0.02}
    found = frames(played(model, particles, 0.1, {"held": None}, instruments=[ball], push_out=True))
    top = np.flatnonzero(mesh.nodes[:, 2] == 0.1)
    axis = np.array([center, center])
    return Answer(found, particles.nodes, clears(top, lambda frame: axis, 0.02))
