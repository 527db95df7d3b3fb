"""The registry of effects and integrators: names and import paths. A module is imported when a scene calls for it.

To add an effect to palpate, add its module, a line to EFFECTS, its block to effects.settings, and a field to Scene.
"""

import importlib
from dataclasses import dataclass
from types import ModuleType

from palpate.bodies.material import EXPONENTIAL, LAWS, kind_of

FORMS = ("solid", "surface", "sheet")
"""Forms of bodies: with tetrahedra inside, the surface alone, a flat sheet."""
SOLID, SHEET = FORMS[:1], FORMS[2:]
OWN_LAW = "own_law"
"""The effect of finite elements whose law is a file of the user's."""
FINITE_ELEMENTS = (*LAWS, EXPONENTIAL, OWN_LAW)
"""Effects of finite elements: the name is that of the body's law, without its stiffening."""


@dataclass(frozen=True)
class Entry:
    """One effect.

    module : import path of its ``make``
    role : "elastic" (holds a body together; a scene has exactly one), "damping" (takes energy out of it) or "other"
    forms : the forms of bodies that it suits; elastic : the elastic effects that it works with
    """

    module: str
    role: str = "other"
    forms: tuple[str, ...] = FORMS
    elastic: tuple[str, ...] = (*FINITE_ELEMENTS, "triangles", "springs", "shape_matching")


EFFECTS = {
    **{law: Entry("palpate.effects.linear_elements", "elastic", forms=SOLID) for law in FINITE_ELEMENTS},
    "triangles": Entry("palpate.effects.triangles", "elastic", forms=SHEET),
    "springs": Entry("palpate.effects.springs", "elastic"),
    "shape_matching": Entry("palpate.effects.shape_matching", "elastic"),
    "gravity": Entry("palpate.effects.gravity"),
    "held": Entry("palpate.effects.held"),
    "bed": Entry("palpate.effects.bed", forms=FORMS[:2]),
    "push": Entry("palpate.effects.push"),
    "cut": Entry("palpate.effects.cut", forms=SOLID, elastic=(*FINITE_ELEMENTS, "springs")),
    "hooks": Entry("palpate.effects.hooks"),
    "threads": Entry("palpate.effects.threads"),
    "bending": Entry("palpate.effects.bending", forms=SHEET),
    "volume": Entry("palpate.effects.volume_preservation", forms=SOLID),
    "body_springs": Entry("palpate.effects.body_springs"),
    "contact": Entry("palpate.collision.contact.barrier_contact"),
    "plasticity": Entry("palpate.effects.plasticity", elastic=("corotational", "shape_matching")),
    "prony": Entry("palpate.effects.prony", forms=SOLID, elastic=FINITE_ELEMENTS),
    "rayleigh": Entry("palpate.effects.rayleigh", "damping"),
    "kelvin": Entry("palpate.effects.kelvin", "damping", elastic=("springs",)),
    "maxwell": Entry("palpate.effects.maxwell", "damping", elastic=("springs",)),
    "velocity_damping": Entry("palpate.effects.velocity_damping", "damping"),
}
"""One line for each effect."""
ELASTIC = tuple(name for name, entry in EFFECTS.items() if entry.role == "elastic")

INTEGRATORS = {
    "symplectic_euler": "palpate.solvers.symplectic_euler",
    "backward_euler": "palpate.solvers.backward_euler",
    "bdf2": "palpate.solvers.bdf2",
    "touching": "palpate.models.stroke_motion",
    "goal_position": "palpate.solvers.goal_position",
    "xpbd": "palpate.solvers.xpbd",
    "projective_dynamics": "palpate.solvers.projective_dynamics",
    "vertex_block_descent": "palpate.solvers.vertex_block_descent",
}

NOT_STEPPED = {
    "xpbd": ("prony", "body_springs", "volume", "hooks"),
    "projective_dynamics": ("prony", "body_springs", "volume"),
    "vertex_block_descent": ("prony", "body_springs", "volume", "threads"),
    "touching": (
        "gravity",
        "bed",
        "push",
        "hooks",
        "threads",
        "volume",
        "body_springs",
        "plasticity",
        "prony",
        "cut",
    ),
}
"""Effects that an integrator has no part for, of those that suit its elastic effect."""

RESERVED = ("kinetic", "outer_work", "total", "gain", "integrator")
"""Names of columns and rows in the tables, which effects cannot have."""


def effect(name: str) -> ModuleType:
    """Import the module of one of EFFECTS."""
    return importlib.import_module(EFFECTS[name].module)


def integrator(name: str) -> ModuleType:
    """Import the module of one of INTEGRATORS."""
    return importlib.import_module(INTEGRATORS[name])


def of_law(law: str) -> str:
    """Return the name of the effect of finite elements of a body's ``law``."""
    return kind_of(law) or OWN_LAW
