"""Hard initial states: bodies that start inverted, collapsed or in a random state.

For springs only the energy is checked: a mirror image is a rest state for them too, so they need not return.
"""

from functools import partial

import numpy as np

from palpate.evaluation.hard_cases.hard_case import Case
from palpate.evaluation.hard_cases.stage import EXPLICIT, FEM, SHAPES, SPRINGS, Stepper, bar, edge_error
from palpate.scenes.initial_states import initial_positions

SOURCES = {
    "inverted": "Irving, Teran, Fedkiw 2004",
    "plane": "Smith, de Goes, Kim 2018",
    "line": "Smith, de Goes, Kim 2018",
    "point": "Li et al. 2020 (IPC), one point",
    "random": "Li et al. 2020 (IPC), random",
}
BREATH = 1e-9
"""Perturbation, relative to the body's size, of starts that have to return to rest. Trap: a start of exactly zero width
stays so, in an unstable equilibrium of the corotational energy, which is smoothed there, so that no force arises."""
STEP_S = {"fem_implicit": 0.05, "springs_implicit": 0.05, "springs_explicit": 5e-4, "fem_explicit": 5e-4}
GAIN = "energy gain / energy at the start"


def cases() -> list[Case]:
    """Return the declared cases of this family."""
    found = []
    for kind, source in SOURCES.items():
        words = (
            f"start_{kind}",
            "fem",
            source,
            f"a free body starts {kind}",
            "its rest shape, at any place and rotation",
        )
        measure = "largest relative edge error after 20 s"
        found.append(Case.of(*words, measure, 0.01, run=partial(_back, kind), models=(*FEM, *SHAPES)))
    for kind, source in SOURCES.items():
        words = (f"energy_from_{kind}", "fem", source, f"a held body starts exactly {kind}", "no gain of energy")
        # a spring of zero length has no direction
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
    return edge_error(particles, x)


def _gain(kind: str, model: str) -> float:
    particles = bar()
    stepper = Stepper(model, particles, {"held": None})
    x = initial_positions(particles, stepper.system.free, kind, seed=1)
    first = stepper.total(x, np.zeros_like(x))
    stepper.go(x, np.zeros_like(x), STEP_S[model], 100)
    return stepper.gained / first
