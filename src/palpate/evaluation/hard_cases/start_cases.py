"""Hard starts: bodies that begin in states that no good body should ever be in.

Springs are asked not to gain energy only: a mirror image is at rest for them too, so they need not come back.
"""

from functools import partial

import numpy as np

from palpate.evaluation.hard_cases.hard_case import Case
from palpate.evaluation.hard_cases.stage import EXPLICIT, FEM, SHAPES, SPRINGS, Stepper, bar, edges_off
from palpate.scenes.initial_states import initial_positions

SOURCES = {
    "inverted": "Irving, Teran, Fedkiw 2004",
    "plane": "Smith, de Goes, Kim 2018",
    "line": "Smith, de Goes, Kim 2018",
    "point": "Li et al. 2020 (IPC), one point",
    "random": "Li et al. 2020 (IPC), random",
}
BREATH = 1e-9
"""Of the body's size, added to starts that have to come back. Trap: with exactly no width a thread or a dot stays one:
an unstable balance of the corotational energy, whose fold is rounded off there, so that no force leads out of it."""
STEP_S = {"fem_implicit": 0.05, "springs_implicit": 0.05, "springs_explicit": 5e-4, "fem_explicit": 5e-4}
GAIN = "energy that came from nowhere, in that of the start"


def cases() -> list[Case]:
    """The cases of this family: the declared list."""
    found = []
    for kind, source in SOURCES.items():
        words = (f"start_{kind}", "fem", source, f"a free body starts {kind}", "its rest shape, somewhere, turned")
        measure = "largest edge off after 20 s, in its length"
        found.append(Case.of(*words, measure, 0.01, run=partial(_back, kind), models=(*FEM, *SHAPES)))
    for kind, source in SOURCES.items():
        words = (f"energy_from_{kind}", "fem", source, f"a held body starts {kind}, exactly", "energy is never gained")
        # no force tells a spring of no length where to go
        declared = {"springs_implicit": ("stable", "not_converged")} if kind == "point" else {}
        models = (*FEM, *SPRINGS, *EXPLICIT)
        found.append(Case.of(*words, GAIN, 1e-9, run=partial(_gain, kind), models=models, declared=declared))
    return found


def _back(kind: str, model: str) -> float:
    particles = bar(held=False)
    x = initial_positions(particles, np.ones(len(particles.nodes), dtype=bool), kind, seed=1)
    x = x + BREATH * particles.size * np.random.default_rng(2).normal(size=x.shape)
    step_s, steps = (0.05, 400) if model in FEM else (0.01, 2000)
    x, _ = Stepper(model, particles).go(x, np.zeros_like(x), step_s, steps)
    return edges_off(particles, x)


def _gain(kind: str, model: str) -> float:
    particles = bar()
    stepper = Stepper(model, particles, {"held": None})
    x = initial_positions(particles, stepper.system.free, kind, seed=1)
    first = stepper.total(x, np.zeros_like(x))
    stepper.go(x, np.zeros_like(x), STEP_S[model], 100)
    return stepper.gained / first
