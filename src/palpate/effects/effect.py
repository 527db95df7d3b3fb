"""The interface of effects: one Protocol for each hook that an effect may offer, and ``offers``, which finds them.

An effect is one physical influence on a body. It is any object that ``make(particles, settings, elastic)`` of its
module returns: ``settings`` is the scene's block of the effect's name, ``elastic`` the effect that holds the body
together, which is made first (None for that effect itself); ``make`` raises InputError if they do not suit the effect.

An effect offers the hooks that it needs and leaves out the others. No base class is required: an effect offers a hook
if it has the members of that hook. The effects of palpate name their hooks as base classes, so that the type check
compares them with this file. ``System`` looks for the hooks once, before the first step, and each step calls only what
it found.

Arguments are the same everywhere: positions ``x`` (n, 3) [m] and velocities ``v`` (n, 3) [m/s] of all n nodes, a step
``h`` [s]. A hook changes an argument only where its description says "in place", and returns nothing then.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, TypeGuard, TypeVar

import numpy as np

if TYPE_CHECKING:
    import pandas as pd

    from palpate.bodies.particles import Particles
    from palpate.effects import settings

Hook = TypeVar("Hook")


class Effect(Protocol):
    """Any effect. It has no members of its own, because each hook is optional."""


class Force(Protocol):
    """A force. Each integrator needs it."""

    def add_force(self, x: np.ndarray, v: np.ndarray, force: np.ndarray) -> None:
        """Add the nodal forces [N] to ``force`` (n, 3) in place; minus the gradient of the energy, if there is one."""


class Energy(Force, Protocol):
    """A potential energy. Backward Euler minimises it; the energy table has a column for it."""

    def energy(self, x: np.ndarray) -> float:
        """Return the potential energy [J]; infinite where ``x`` is forbidden."""


class Load(Force, Protocol):
    """A force from outside. Backward Euler keeps it constant during a step; its work is counted separately.

    outer : True for a load; False is the same as no such member
    """

    outer: bool


class Couples(Protocol):
    """Elements whose nodes interact, so that a matrix has a block for each pair of them.

    couples : (m, k) the nodes of each element, integers from 0 to n − 1; constant
    """

    couples: np.ndarray


class Stiffness(Couples, Protocol):
    """The Hessian of the energy. Backward Euler and the stable step of the explicit integrators need it."""

    def add_stiffness(self, x: np.ndarray, definite: bool, slots: np.ndarray, values: np.ndarray) -> None:
        """Add the Hessian [N/m] to ``values`` (n_blocks, 3, 3) in place.

        The block of the nodes ``couples[e, a]`` and ``couples[e, b]`` belongs in ``values[slots[e, a, b]]``, ``slots``
        being (m, k, k). ``definite`` asks for a positive semidefinite approximation.
        """


class Damping(Couples, Protocol):
    """The damping matrix C. Backward Euler and the stable step of the explicit integrators need it."""

    def add_damping(self, x: np.ndarray, slots: np.ndarray, values: np.ndarray) -> None:
        """Add C [N s/m] to ``values`` in place, as ``add_stiffness`` does; ``add_force`` then adds −C v."""


class Proportional(Damping, Protocol):
    """A damping matrix α M + β K, K being the Hessian of the elastic energy. Motions in modes need the two rates.

    damping_rates : α [1/s] and β [s]
    """

    damping_rates: tuple[float, float]


class Time(Protocol):
    """A dependence on time."""

    def at(self, t: float) -> None:
        """Set the time ``t`` [s] at the end of the next step."""


class FixedNodes(Protocol):
    """Nodes that do not move.

    fixed : (k,) their numbers; constant
    """

    fixed: np.ndarray


class HeldNodes(Protocol):
    """A need to know which nodes do not move."""

    def hold(self, fixed: np.ndarray) -> None:
        """Take the numbers (k,) of all nodes that any effect fixes; called once, before the first step."""


class Projection(Protocol):
    """A change of the state at the end of an explicit step. The explicit integrators use it and not ``add_force``."""

    def project(self, start: np.ndarray, x: np.ndarray, v: np.ndarray, h: float) -> None:
        """Change the positions ``x`` and velocities ``v`` in place at the end of a step from ``start`` (n, 3) [m]."""


class Placement(Protocol):
    """A change of the places from which a scene begins."""

    def place(self, x: np.ndarray) -> np.ndarray:
        """Return the positions (n, 3) [m] from which the first step begins, given those that the scene describes."""


class StepBegin(Protocol):
    """Work at the beginning of an implicit step, such as the motion of an obstacle."""

    def begin(self, x: np.ndarray, h: float) -> np.ndarray:
        """Return the positions (n, 3) [m] from which the search begins: ``x``, unless something was moved into it."""


class StepEnd(Protocol):
    """Work at the end of an implicit step, such as an update of inner variables by what ``begin`` prepared."""

    def end(self, x: np.ndarray) -> None:
        """Update what depends on an implicit step, or a part of one, that is accepted and ends at ``x`` (n, 3) [m]."""


class Driven(StepEnd, Protocol):
    """An object that is moved from outside, such as an instrument, and does work on the bodies.

    work_j : this work so far [J]; ``end`` adds that of implicit steps, a projection that of explicit ones
    """

    work_j: float


class StepLimit(Protocol):
    """A limit to each step of the implicit search, so that no surface passes through another.

    The force of such an effect may grow without bound.
    """

    def limit(self, x: np.ndarray, direction: np.ndarray) -> float:
        """Return the fraction of ``direction`` (n, 3) [m], at most 1, by which the nodes may move from ``x``."""


class Touching(Protocol):
    """A stiffness between nodes that change from step to step, such as nodes in contact."""

    def touching(self, x: np.ndarray, definite: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return rows (k,), columns (k,) and blocks (k, 3, 3) [N/m] of the Hessian; numbers of n and above are ignored.

        ``definite`` asks for a positive semidefinite approximation.
        """


class Instrumented(Protocol):
    """Contact with instruments whose forces a motion in few coordinates can compute itself.

    settings : the block that it is made of
    """

    settings: "settings.Contact"

    def instruments_on(self) -> Any:
        """Return the InstrumentContact; InputError if more can be touched than spheres and capsules.

        From then on the caller steps, and writes work and reactions to what is returned.
        """


class Corrections(Touching, Energy, StepEnd, Protocol):
    """Constraints with a compliance, for methods that correct positions by one constraint after another.

    Before the first step ``touching`` has the stiffness of all of them.
    """

    def correct(self, x: np.ndarray, inverse: np.ndarray, h: float, first: bool) -> None:
        """Correct ``x`` (n, 3) [m] once in a step of ``h`` [s], in place; ``first`` begins with multipliers of zero.

        inverse : of the masses (n,) [1/kg], 0 where a node is held
        """


class Untying(Protocol):
    """Nodes that are one until something, such as a blade, has passed between them.

    changes_s : (k,) times [s] at which nodes are let go, increasing
    """

    changes_s: np.ndarray

    def leaders(self, t: float) -> np.ndarray:
        """Return the node (n,) that each one moves with at ``t`` [s], itself where nothing ties it."""


class Following(Protocol):
    """Nodes of its own that ``couples`` does not list, of which some are tied to others while a body is cut."""

    def follow(self, leaders: np.ndarray) -> None:
        """Act on the nodes that ``leaders`` (n,) has in place of each one."""


class Surface(Protocol):
    """A need to know where the surface of the bodies is when a cut opens it."""

    def resurface(self, particles: "Particles") -> None:
        """Take the ``triangles``, in which no node is that is tied to another, and the masses of ``particles``."""


class Relaxation(Protocol):
    """Inner variables, such as plastic strain."""

    def relax(self, x: np.ndarray, h: float) -> None:
        """Update the inner variables after an accepted step."""


class Goals(Protocol):
    """Goal positions of an elastic effect. The integrator goal_position needs them.

    alpha : fraction of the way to its goal that a node moves in a step, below 4, from which on no step is stable
    """

    alpha: float

    def goals(self, x: np.ndarray, out: np.ndarray) -> None:
        """Write the goal positions [m] to ``out`` (n, 3) in place."""


class Weight(Protocol):
    """A constant acceleration of all nodes; pictures are drawn upright along it.

    acceleration : (3,) [m/s²]
    """

    acceleration: np.ndarray


class Observation(Protocol):
    """Numbers to record."""

    def observe(self, x: np.ndarray) -> dict[str, float]:
        """Return numbers by column name, after each step; names carry the unit.

        An effect with ``Contacts`` returns the force [N] on each obstacle as ``<name>_force_x_n``, …_y_n and …_z_n, by
        which models are judged.
        """


class Rigid(Protocol):
    """A rigid obstacle: its name in tables, and its shape.

    kind : such as "sphere"; points : (k, 3) [m] before it moves; triangles : (m, 3) between them; radius_m : thickness
    around these [m]
    """

    @property
    def name(self) -> str: ...
    @property
    def kind(self) -> str: ...
    @property
    def points(self) -> np.ndarray: ...
    @property
    def triangles(self) -> np.ndarray: ...
    @property
    def radius_m(self) -> float: ...

    def at(self, t: float) -> np.ndarray:
        """Return the points (k, 3) [m] at the time ``t`` [s]."""


class Contacts(Protocol):
    """Contacts to record.

    obstacles : rigid things that the body can meet
    """

    obstacles: Sequence[Rigid]

    def contacts(self, x: np.ndarray) -> "pd.DataFrame":
        """Return one row for each contact, after each step of which a picture is kept."""


class Shape(NamedTuple):
    """A thing that pictures show beside bodies, with the members of ``Rigid``: points (k, 3) [m], triangles (m, 3)."""

    name: str
    kind: str
    radius_m: float
    points: np.ndarray
    triangles: np.ndarray


class Drawn(Protocol):
    """Things that pictures show beside bodies and obstacles, such as threads."""

    def drawn(self, x: np.ndarray) -> Sequence[Shape]:
        """Return where they are at ``x`` (n, 3) [m], after each step of which a picture is kept; always as many."""


HOOKS: tuple[type, ...] = (
    Force, Energy, Load, Couples, Stiffness, Damping, Proportional, Time, FixedNodes, HeldNodes, Projection,
    Placement, StepBegin, StepEnd, Driven, StepLimit, Touching, Corrections, Instrumented, Untying, Following, Surface,
    Relaxation, Goals, Weight, Observation, Contacts, Drawn,
)  # fmt: skip
"""All hooks."""


def offers(effect: object, hook: type[Hook]) -> TypeGuard[Hook]:
    """Return whether ``effect`` has all members of ``hook``, one of HOOKS. Too slow for an inner loop."""
    return all(hasattr(effect, name) for name in members(hook))


def is_load(effect: object) -> bool:
    """Return whether the force of ``effect`` is a load."""
    return offers(effect, Load) and effect.outer


def members(hook: type) -> tuple[str, ...]:
    """Return the names of a hook's members, its own method first."""
    bases = [base for base in hook.__mro__ if base.__module__ == __name__]
    names = [name for base in bases for name in (*vars(base), *base.__annotations__)]
    return tuple(dict.fromkeys(name for name in names if not name.startswith("_")))


def incomplete(effect: object) -> str:
    """Return the first hook that ``effect`` offers in part, such as "energy and no add_force"; empty if none."""
    for hook in HOOKS:
        name, *needed = members(hook)
        missing = [need for need in needed if not hasattr(effect, need)]
        if hasattr(effect, name) and missing:
            return f"{name} and no {missing[0]}"
    return ""
