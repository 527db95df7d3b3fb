"""Hard cases of a finger that presses and strokes an organ: the coarse mesh of the shipped liver, in motion."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from palpate.bodies.material import Material
from palpate.bodies.particles import Particles, particles_of
from palpate.effects.settings import Ball, Capsule, Contact, Rayleigh, Touching
from palpate.models import stroke_motion
from palpate.models.strokes import elements_under, points_of, whole_of
from palpate.scenes.run_scene import compose, run
from palpate.scenes.settings import Scene
from palpate.solvers.touched_motion import STIFFER
from palpate.studies.hard_cases.stage import FIRM, SOFT, Answer, Case, refuses, shipped_liver

RAYLEIGH = Rayleigh()
TOLERANCE = 1e-3
"""Relative residual of each step of quadratic elements."""
STEPPED = {"fem_implicit": ("backward_euler", 16), "fem_bdf2": ("bdf2", 6), "path_modes": ("touching", 4)}
"""The integrator of each model, and its steps in a frame."""
SECOND = "fem_bdf2", "path_modes"
"""Models whose steps are of second order: those of first order are 18 % wrong in steps of 40 ms."""
FRAMES = 20
FINER, QUADRATIC = (8, 16), (1, 2)
"""Two numbers of steps in a frame from which the limit of short steps is extrapolated: of BDF2 with linear elements,
and of quadratic elements, with which modes are compared."""
SHORT_STEPS = "the limit of short steps"
MEASURE = (
    "L2 distance from the limit of short steps over frames and nodes / that of the limit from rest; of modes, from "
    "elements with contact as soft as theirs"
)
FINGER = Capsule(kind="capsule", name="finger", from_m=[0.04, -0.03, 0.08], to_m=[0.04, 0.0, 0.08], radius_m=0.01)
"""As in the scene liver_palpation, above the thin lobe."""
TIMES_S = 0.0, 0.3, 0.4, 0.5, 0.7
SHIFTS_M = [0, 0, 0], [0, 0, -0.032], [0, 0, -0.032], [-0.04, 0, -0.024], [-0.04, 0, 0.01]
DURATION_S = 0.8
DOWN_M = 0.12
"""Depth of a finger that would come out below the lobe if this did not give way."""
OVER_RIM, INTO_HELD = 0.0755, 0.072
"""Heights [m] of a ball that strokes from the soft side over held nodes: just above these, and 2 mm in them."""


def strokes() -> list[Case]:
    def case(name, scene, contact, bound, duration_s=DURATION_S, per_frame=None, expected=SHORT_STEPS, **more):
        limit_of = cache(lambda quadratic: _limit(contact, duration_s, quadratic))

        def answer(model: str) -> Answer:
            integrator, steps = STEPPED[model]
            frames = _linear_motion(contact, duration_s, integrator, per_frame or steps)

            def error(a: np.ndarray) -> float:
                limit = limit_of(model == "path_modes")
                return float(np.linalg.norm(a - limit) / np.linalg.norm(limit))

            return Answer(frames, np.zeros_like(frames), error)

        models = more.pop("models", tuple(STEPPED))
        return Case(f"finger_{name}", scene, expected, MEASURE, bound, answer, models, **more)

    return [
        case("at_speed", "a finger presses the lobe of a liver, strokes it and lifts, four times as fast as a hand: "
             "0.4 to 1.6 m/s, with four corners", _path([t / 4.0 for t in TIMES_S], SHIFTS_M), 0.035, DURATION_S / 4.0,
             bounds={"path_modes": 0.067}),
        case("through", f"a finger is pushed {DOWN_M:g} m down where the lobe is 0.05 m thick, and gives way",
             _path([0.0, 0.3, 0.5], [[0, 0, 0], *[[0, 0, -DOWN_M]] * 2]), 0.035, 0.6, bounds={"path_modes": 0.05}),
        case("through_in_a_step", "the same, 0.16 m in one step of 40 ms",
             _path([0.0, 0.04], [[0, 0, 0], [0, 0, -0.16]]), 0.0, 0.8, 1, "refused", models=("path_modes",),
             declared=("refused",)),
        case("without_friction", "the hand's path, without friction", _path(friction=0.0), 0.035),
        case("friction_of_2", "the hand's path, with a coefficient of friction of 2", _path(friction=2.0), 0.035,
             expected="the limit of short steps; modes of five strokes show too little of tissue that is dragged along",
             declared={"path_modes": ("wrong",)}),
        case("over_held_rim", "a ball strokes from the soft side over the rim of held nodes, and lifts",
             _over(OVER_RIM), 0.035, bounds={"path_modes": 0.06}, blunt=("path_modes",)),
        case("into_held_rim", "the same, 2 mm lower, where nothing gives way", _over(INTO_HELD), 0.0,
             expected="the path leads into what is held", declared=("not_converged",)),
        case("in_steps_of_40_ms", "the hand's press, and held, in steps of 40 ms",
             _path([0.0, 0.3], SHIFTS_M[:2]), 0.115, per_frame=1, models=SECOND, blunt=SECOND,
             bounds={"path_modes": 0.085}),
        Case("modes_of_another_liver", "modes that a liver has learnt step one of another stiffness", "refused",
             MEASURE, 0.0, refuses(_step_modes_of_another_liver), ("path_modes",), ("refused",)),
    ]  # fmt: skip


def _path(
    times_s: Sequence[float] = TIMES_S, shifts_m: Sequence[Sequence[float]] = SHIFTS_M, friction: float = 0.3
) -> Contact:
    """Describe FINGER on a path of its own: displacements (k, 3) [m] at ``times_s`` (k,)."""
    finger = FINGER.but(times_s=list(times_s), shifts_m=[list(shift) for shift in shifts_m])
    return Contact(friction=friction, instruments=[finger])


def _over(height_m: float) -> Contact:
    """Describe a ball pressed into the soft side that strokes over the held part, its centre at ``height_m`` [m]."""
    centres = np.array([[-0.018, 0.005, 0.085], *[[-0.018, 0.01, 0.071]] * 2, [-0.028, 0.065, height_m]])
    centres = np.vstack([centres, [-0.028, 0.065, 0.09]])
    path = {"times_s": [0.0, 0.2, 0.3, 0.6, 0.7], "shifts_m": (centres - centres[0]).tolist()}
    ball = Ball(kind="sphere", name="finger", center_m=centres[0].tolist(), radius_m=0.01, **path)
    return Contact(friction=0.3, instruments=[ball])


@cache
def _liver(material: Material = SOFT) -> Particles:
    return particles_of(shipped_liver(material), 0, surface=False)


def _scene(contact: Contact, duration_s: float, integrator: str, per_frame: int) -> Scene:
    """Describe the motion of the liver under ``contact`` in FRAMES frames of ``per_frame`` steps."""
    stepping = {"integrator": integrator, "step_s": duration_s / (FRAMES * per_frame), "duration_s": duration_s}
    effects = {"contact": contact, "rayleigh": RAYLEIGH}
    return Scene.model_validate({"name": "hard_case", "body": "liver", "frames": FRAMES} | stepping | effects)


def _linear_motion(contact: Contact, duration_s: float, integrator: str, per_frame: int) -> np.ndarray:
    """Return the displacements (FRAMES, n, 3) [m] of the liver at the ends of frames; arguments as of ``_scene``."""
    motion = run(_scene(contact, duration_s, integrator, per_frame), _liver()).motion
    return motion.positions[1:] - motion.rest


def _limit(contact: Contact, duration_s: float, quadratic: bool) -> np.ndarray:
    """Extrapolate the displacements (FRAMES, n, 3) [m] of linear or quadratic elements to short steps (Richardson)."""
    if quadratic:
        longer, shorter = (_quadratic_motion(contact, duration_s, count) for count in QUADRATIC)
    else:
        longer, shorter = (_linear_motion(contact, duration_s, "bdf2", count) for count in FINER)
    return shorter + (shorter - longer) / 3.0


def _quadratic_motion(contact: Contact, duration_s: float, per_frame: int) -> np.ndarray:
    """Return the displacements (FRAMES, n, 3) [m] at the ends of frames, with contact as soft as that of modes."""
    body = shipped_liver()
    points = points_of(body, [contact])
    elements = elements_under(body, contact, RAYLEIGH, replace(points, penalty=points.penalty / STIFFER))
    steps = elements.touched_steps(duration_s / (FRAMES * per_frame), FRAMES * per_frame, TOLERANCE)
    # the first nodes of quadratic elements are the corners
    frame_ends = list(steps)[per_frame - 1 :: per_frame]
    return np.array([(state.x - elements.rest)[: len(body.fine.nodes)] for state in frame_ends])


def _step_modes_of_another_liver() -> None:
    scene = _scene(_path(), DURATION_S, "touching", 4)
    soft_liver = _liver()
    assert soft_liver.body is not None
    displacements = np.random.default_rng(1).normal(0.0, 1e-3, (4, len(whole_of(soft_liver.body).levels[-1].nodes), 3))
    learnt = stroke_motion.prepare(compose(scene, soft_liver), Touching(), displacements)
    run(scene.but(touching=stroke_motion.Learnt(learnt=learnt)), _liver(FIRM))
