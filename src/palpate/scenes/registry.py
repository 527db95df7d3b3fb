"""Where each effect and integrator lives. Names only: a module is imported when a scene calls for it."""

import importlib
import importlib.util
from difflib import get_close_matches
from pathlib import Path
from types import ModuleType

from palpate.errors import InputError

ELASTIC = ("corotational", "triangles", "springs", "shape_matching")
"""Effects that hold a body together; a scene names exactly one."""
OTHERS = (
    "gravity",
    "held",
    "push",
    "bending",
    "volume",
    "body_springs",
    "contact",
    "plasticity",
    "rayleigh",
    "kelvin",
    "maxwell",
    "velocity_damping",
)
INTEGRATORS = ("symplectic_euler", "backward_euler", "goal_position")

EFFECTS = {name: f"palpate.effects.{name}" for name in (*ELASTIC, *OTHERS)}
SOLVERS = {name: f"palpate.solvers.{name}" for name in INTEGRATORS}


def effect(name: str, own: dict[str, Path], place: str) -> ModuleType:
    """The module of an effect: ours, or one of the user's ``own`` files; InputError if there is none."""
    if name in own:
        return _from_file(name, own[name], place)
    if name not in EFFECTS:
        known = [*own, *EFFECTS]
        near = get_close_matches(name, known, n=1)
        remedy = f"did you mean {near[0]}?" if near else f"choose among {', '.join(known)}."
        raise InputError(f"{place}.effects names {name}, which is unknown; {remedy}")
    return importlib.import_module(EFFECTS[name])


def integrator(name: str) -> ModuleType:
    """The module of an integrator."""
    return importlib.import_module(SOLVERS[name])


def _from_file(name: str, path: Path, place: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(f"palpate_own_{name}", path)
    if spec is None or not Path(path).is_file():
        raise InputError(f"{place}.own.{name} is {path}, which is no Python file; give the path of one.")
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        raise InputError(f"{path}: cannot be imported ({type(error).__name__}: {error}); mend it.") from error
    if not hasattr(module, "make"):
        raise InputError(f"{path}: has no function make(particles, settings, elastic); see docs/add-an-effect.md.")
    return module
