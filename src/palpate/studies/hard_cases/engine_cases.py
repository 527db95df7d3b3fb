"""Hard cases of optional engines: large loads, thin elements, ν = 0.49; there are none where no engine is installed."""

from dataclasses import replace
from functools import partial

import numpy as np

from palpate.benchmark.accuracy import errors
from palpate.benchmark.load import displacement_of
from palpate.bodies.material import LAWS
from palpate.effects.elements import locking_is_measured
from palpate.models import fem, quadratic_neo_hookean
from palpate.models.model_registry import ENGINES, absent, model
from palpate.studies.hard_cases.contact_mode_cases import bar, case_of, pressing
from palpate.studies.hard_cases.hard_case import Answer, Case

SETTINGS: dict[str, dict[str, float]] = {
    "mujoco": {"level": 0, "steps": 60, "iterations": 200},
    "newton_vbd": {"level": 0, "steps": 400, "sweeps": 20, "step": 3.0},
}
"""Long enough that what is left is what the engine itself does."""
EXPECTED = "the equilibrium of linear elements with the engine's own law, on the same mesh"


def cases() -> list[Case]:
    """Return the declared cases of the engines that are installed."""
    found = [name for name in ENGINES if name not in absent()]

    def case(name: str, scene: str, times: float = 1.0, **body: float) -> Case:
        words = (f"engine_{name}", "fem", "palpate", scene, EXPECTED, "RMSE / peak against that equilibrium", 0.01)
        return Case.of(*words, run=partial(_pressed, times, body), models=found)

    listed = [
        case("twice_the_load", "a bar's end is pressed so that it moves by a fifth of its length", 2.0),
        case("three_times_the_load", "the same by three tenths of its length", 3.0),
        case("pulled", "the same as a pull, by a tenth", -1.0),
        case("slivers", "a layer of elements with dihedral angles of a degree", degrees=1.0),
        case("incompressible", "ν = 0.49", poisson=0.49),
    ]
    return listed if found else []


def _pressed(times: float, changed: dict[str, float], engine: str) -> Answer:
    """Press the bar as contact modes are, with another law, and compare with Newton's method."""
    made, body = model(engine, {}), bar(**changed)
    law = made.law if made.law in LAWS else quadratic_neo_hookean.__file__
    case = case_of(replace(body, material=replace(body.material, law=law)))
    load = pressing(body, [0.0, 0.0, -times])
    with locking_is_measured():
        found = displacement_of(made.offline(case).online(SETTINGS[engine]).respond(load))
        converged = fem.Fem(case, {"level": 0, "start": "rest", "tolerance": 1e-8}, 1)
        expected = displacement_of(converged.respond(load))
    return Answer(found, np.zeros_like(found), lambda answer: errors(answer, expected).rmse_of_peak)
