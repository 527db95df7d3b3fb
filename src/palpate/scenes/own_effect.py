"""Effects of the user's own: loaded from their files, and tried before they are trusted."""

import importlib.util
from pathlib import Path
from types import ModuleType

import numpy as np

from palpate.bodies.particles import Particles
from palpate.errors import InputError

OFFERS = ("energy", "add_force", "add_stiffness", "add_damping", "fixed", "project", "relax", "goals")
"""An effect that has none of these does nothing."""
GUIDE = "see docs/add-an-effect.md"


def load(name: str, path: Path, place: str) -> ModuleType:
    """The module in the file ``path``; InputError if it is none that makes an effect."""
    module = opened(path, f"{place}.own.{name}")
    if not hasattr(module, "make"):
        raise InputError(f"{path}: has no function make(particles, settings, elastic); {GUIDE}.")
    return module


def opened(path: Path, key: str) -> ModuleType:
    """The module in a file of the user's that ``key`` of the config names; InputError if it cannot be imported."""
    spec = importlib.util.spec_from_file_location(f"palpate_{key.replace('.', '_')}", path)
    if spec is None or not Path(path).is_file():
        raise InputError(f"{key} is {path}, which is no Python file; give the path of one.")
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        raise InputError(f"{path}: cannot be imported ({type(error).__name__}: {error}); mend it.") from error
    return module


def make(path: Path, module: ModuleType, particles: Particles, settings: dict, elastic: object) -> object:
    """The effect that ``module`` makes, tried once at rest; InputError naming its file and what is wrong with it."""
    try:
        effect = module.make(particles, settings, elastic)
        wrong = _wrong(effect, particles)
    except InputError:
        raise
    except Exception as error:
        raise InputError(f"{path}: does not work ({type(error).__name__}: {error}); mend it, {GUIDE}.") from error
    if wrong:
        raise InputError(f"{path}: {wrong}; mend it, {GUIDE}.")
    return effect


def _wrong(effect: object, particles: Particles) -> str:
    """What is wrong with an effect, or nothing."""
    if not any(hasattr(effect, name) for name in OFFERS):
        return f"what make returns has none of {', '.join(OFFERS)}"
    for has, needs in (("energy", "add_force"), ("add_stiffness", "couples"), ("add_damping", "couples")):
        if hasattr(effect, has) and not hasattr(effect, needs):
            return f"the effect has {has} and no {needs}"
    n = len(particles.nodes)
    for name in ("couples", "fixed"):
        nodes = np.asarray(getattr(effect, name, []))
        if nodes.size and (nodes.dtype.kind != "i" or nodes.min() < 0 or nodes.max() >= n):
            return f"{name} names nodes other than 0 to {n - 1}"
    if hasattr(effect, "at"):
        effect.at(0.0)
    if hasattr(effect, "add_force"):
        x, force = particles.nodes.copy(), np.zeros((n, 3))
        if effect.add_force(x, np.zeros((n, 3)), force) is not None:
            return "add_force returns something, but must add to its third argument in place"
        if not np.array_equal(x, particles.nodes):
            return "add_force changes the positions it is given"
        if not np.isfinite(force).all():
            return "add_force gives forces at rest that are not finite"
    if hasattr(effect, "energy") and not np.isfinite(effect.energy(particles.nodes.copy())):
        return "energy at rest is not a finite number"
    return ""
