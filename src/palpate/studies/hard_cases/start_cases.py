"""Hard initial states: bodies that start inverted, collapsed or in a random state.

Springs have to find some equilibrium only: a mirror image is a rest state for them too, so they need not return.
"""

from collections.abc import Sequence
from functools import partial

import numpy as np

from palpate.scenes.run_scene import initial_positions
from palpate.studies.hard_cases.drift import returns
from palpate.studies.hard_cases.hard_case import Answer, Case
from palpate.studies.hard_cases.stage import EXPLICIT, FEM, SHAPES, SPRINGS, Stepper, bar, unbalanced

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
GAIN = 1e-9
"""Largest gain of energy, relative to that at the start, that rounding may cause."""
WEIGHT = {"gravity": {"acceleration_m_s2": [0.0, 0.0, -0.05]}}
SLOW = {"rayleigh": {"mass_1_s": 5.0, "stiffness_s": 0.0}}
IMPLICIT_STEPS = (0.05, 100), (1.0, 30)
"""Steps [s] and their number: the last are so long that they damp the slowest mode to nothing."""
EXPLICIT_STEPS = ((5e-4, 10_000),)


def cases() -> list[Case]:
    """Return the declared cases of this family."""
    found = []
    for kind, source in SOURCES.items():
        scene, expected = f"a free body starts {kind} and drifts", "its rest shape, where the drift takes it"
        words = (f"start_{kind}", "fem", source, scene, expected)
        measure = "largest relative error of edges or of the centre's way after 20 s"
        found.append(Case.of(*words, measure, 0.01, run=partial(_back, kind), models=(*FEM, *SHAPES)))
    for kind, source in SOURCES.items():
        scene, expected = f"a held body starts exactly {kind}, under a weight", "an equilibrium, without gain of energy"
        words = (f"settles_from_{kind}", "fem", source, scene, expected)
        # a spring of zero length has no direction
        declared = {"springs_implicit": ("stable", "not_converged")} if kind == "point" else {}
        models = (*FEM, *SPRINGS, *(EXPLICIT if kind == "random" else ()))
        measure = "residual force / the weight; more than 1 if energy was gained"
        found.append(Case.of(*words, measure, 0.2, run=partial(_settles, kind), models=models, declared=declared))
    return found


def _back(kind: str, model: str) -> Answer:
    particles = bar(held=False)
    x = initial_positions(particles, np.ones(len(particles.nodes), dtype=bool), kind, seed=1)
    x = x + BREATH * particles.size * np.random.default_rng(2).normal(size=x.shape)
    return returns(model, particles, x)


def _settles(kind: str, model: str) -> Answer:
    particles = bar()
    start = initial_positions(particles, ~np.isin(np.arange(len(particles.nodes)), particles.held), kind, seed=1)
    return settle(Stepper(model, particles, {"held": None} | WEIGHT | (SLOW if model in EXPLICIT else {})), start)


def settle(stepper: Stepper, start: np.ndarray, phases: Sequence[tuple[float, int]] | None = None) -> Answer:
    """Simulate how a body comes to rest, from positions ``start`` (n, 3) [m]; judged by the balance of forces.

    phases : the steps [s] and their number, one after the other; those of implicit models if not given
    """
    explicit = stepper.integrator.limit_s < np.inf
    x, v, gained = start, np.zeros_like(start), 0.0
    first = stepper.total(x, v)
    for step_s, steps in phases or (EXPLICIT_STEPS if explicit else IMPLICIT_STEPS):
        x, v = stepper.go(x, v, step_s, steps)
        gained = max(gained, stepper.gained / abs(first))

    def error(a: np.ndarray) -> float:
        return unbalanced(stepper.system, a) if gained <= GAIN else 1.0 + gained

    return Answer(x, start, error, zero=stepper.system.particles.nodes)
