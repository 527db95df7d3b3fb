"""Where each effect and integrator lives. Names only: a module is imported when a scene calls for it."""

import importlib
from collections.abc import Iterable
from types import ModuleType

from palpate.errors import stranger

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

EFFECTS = {name: f"palpate.effects.{name}" for name in (*ELASTIC, *OTHERS)} | {
    "shape_matching": "palpate.effects.shape_matching.goal_shapes",
    "contact": "palpate.collision.contact.contact_effect",
}
SOLVERS = {name: f"palpate.solvers.{name}" for name in INTEGRATORS}


RESERVED = ("kinetic", "outer_work", "total", "integrator")
"""What columns and rows of the tables are called, and effects therefore are not."""


def effect(name: str) -> ModuleType:
    """The module of one of EFFECTS."""
    return importlib.import_module(EFFECTS[name])


def unknown(names: list[str], own: Iterable[str]) -> str:
    """What is wrong with the names of effects, or nothing; ``own`` names those that a scene brings along."""
    for name in own:
        if name in EFFECTS or name in RESERVED:
            return f"own.{name} has a name that palpate uses itself; call it something else"
    found = stranger(names, [*own, *EFFECTS])
    return f"effects names {found}" if found else ""


def integrator(name: str) -> ModuleType:
    """The module of an integrator."""
    return importlib.import_module(SOLVERS[name])
