"""Define a model, an object whose fields are its setting, what it prepares to answer with, and what it may see."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from importlib import import_module
from time import perf_counter
from types import FunctionType, MethodType, ModuleType
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, Self, TypeVar

import numpy as np

from palpate.benchmark.load import Answer, Doubted, Load, Response, SurfacePress
from palpate.benchmark.settings import FitOptions
from palpate.errors import InputError, NotConverged
from palpate.setting_types import Block

if TYPE_CHECKING:
    from palpate.benchmark.database import Database
    from palpate.bodies.body import Body
    from palpate.effects.patch_load import Patch
    from palpate.solvers.compliance import Compliance

Setting = dict[str, Any]
"""What tables call a setting: name → int, float, str or bool."""
Made = TypeVar("Made")
_PLAIN = (str, bytes, int, float, bool, complex, type(None), type)
_FOREIGN = ("numba", "llvmlite", "ctypes", "_ctypes")
"""Packages whose objects are code, and lead to everything that was ever compiled."""


class Kept(dict[Hashable, tuple[Any, float]]):
    """Objects that models and settings of one case share, by name, each with the time that making it took [s].

    They do not count as memory of a solver.
    """


@dataclass(frozen=True, eq=False)
class Case:
    """One body in one regime of loads, and all that a model may learn from; it holds no test sample.

    radius_m : of the disc that a force is spread over; 0 presses on one node
    database, response : what ``use_training``, ``meshes`` and ``use_compliance`` give; models call those, so that
        what they use is added to their preparation
    options : how regressions are fitted; ``options.seed`` is for every random choice
    tolerance : relative residual at which run-time solves stop
    used : what was used, with its cost [s]; the evaluation adds it to the offline time
    kept : what ``share`` has made
    """

    body: Body
    regime: str
    radius_m: float
    database: Database
    response: Compliance | None
    options: FitOptions
    tolerance: float
    used: dict[str, float] = field(default_factory=dict)
    kept: Kept = field(default_factory=Kept)

    @staticmethod
    def untrained(body: Body, regime: str, radius_m: float, seed: int, tolerance: float) -> Case:
        """Return the case of a body alone, without any sample or response, for models that need none."""
        from palpate.benchmark.database import database_of

        coarse, fine = (np.empty((0, len(mesh.nodes), 3)) for mesh in (body.coarse, body.fine))
        database = database_of(body, np.empty(0, dtype=int), np.empty((0, 3)), coarse, fine)
        return Case(body, regime, radius_m, database, None, FitOptions(seed=seed), tolerance)

    def use_training(self) -> Database:
        """Return the k training samples, and charge what simulating them took; InputError if there are none.

        contact (k,), force (k, 3) [N], fine (k, n_surface, 3) [m], coarse_live …
        """
        if not self.n_training:
            raise InputError(f"{self.body.name}: this case has no samples; simulate some, or take what learns nothing.")
        self.charge("training", float(self.database.seconds.sum()))
        return self.database

    def use_compliance(self) -> Compliance:
        """Return linear responses to unit forces at every contact, and charge them; InputError if there are none."""
        if self.response is None:
            raise InputError(f"{self.body.name}: this case has no compliance; compute it, or leave out what needs it.")
        self.charge("compliance", self.response.seconds)
        return self.response

    def charge(self, what: str, seconds: float) -> None:
        """Add ``seconds`` to the offline time; the same thing is charged once, at its highest."""
        self.used[what] = max(seconds, self.used.get(what, 0.0))

    def share(self, name: Hashable, make: Callable[[], Made], charged: str = "") -> Made:
        """Return what ``make`` makes, made once for all models and settings of this case.

        name : with all that it depends on, such as the body or the samples, which other cases may replace
        charged : name by which every later user is charged for what it took; the first has waited for it
        """
        if name not in self.kept:
            begin = perf_counter()
            made = make()
            self.kept[name] = made, perf_counter() - begin
        elif charged:
            self.charge(charged, self.kept[name][1])
        return self.kept[name][0]

    @property
    def meshes(self) -> Database:
        """The database without any sample: fine surface, coarse mesh, interpolation between them. Costs nothing."""
        return self.database.take(np.empty(0, dtype=int))

    @property
    def prepared_contacts(self) -> np.ndarray:
        """The contacts, increasing, whose linear responses are stored; without such, none. Costs nothing."""
        return np.empty(0, dtype=int) if self.response is None else self.response.contacts

    @property
    def n_surface(self) -> int:
        """The number of fine surface nodes, whose displacements are asked for."""
        return len(self.database.nodes_fine_surface)

    @property
    def n_training(self) -> int:
        """The number of training samples; asking costs nothing."""
        return len(self.database.contact)

    def first(self, count: int | None) -> Case:
        """Return the case with the first ``count`` training samples of a seeded order, or with all of them for None."""
        order = np.random.default_rng(self.options.seed).permutation(self.n_training)
        return replace(self, database=self.database.take(np.sort(order[:count])))


class Solver:
    """A prepared model: what answers. Those of a user's file need no base class.

    presses_anywhere : whether ``place`` presses discs anywhere on the surface, and not at its nodes alone
    """

    presses_anywhere = False

    @property
    def memory_mb(self) -> float:
        """The memory that is held between queries [MB], read after them."""
        return held_mb(self)

    def respond(self, load: Load) -> np.ndarray | Answer:
        """Return the displacement (n_surface, 3) [m] of the fine surface under ``load``, or an ``Answer`` with more.

        This is timed; ``checked`` looks at the answer afterwards. Raises NotConverged where there is no answer, its
        kind Refused for a load of a sort that the model cannot answer, and InputError for a contact that cannot be
        pressed, or that is not prepared.
        """
        raise NotImplementedError

    def precede(self, load: Load) -> None:
        """Do what comes before a query and is not timed: find the frame before, or prepare contacts and charge them."""

    def prepare_nodes(self, nodes: tuple[int, ...]) -> float | None:
        """Prepare presses at all of these nodes together; return the time [s], or None where nothing is prepared."""
        return None

    def place(self, number: int, patch: Patch) -> int:
        """Place a disc anywhere on the surface; return what loads give as its node, until ``number`` is placed anew."""
        raise NotImplementedError


class Model(Block):
    """A way of answering presses, whose fields are its setting; ``palpate.models.kinds`` has palpate's.

    law : of the material, as a table has it; BODYS where it is the body's own, "" if it is not known
    sees : "load", if it is given the force, or "deformation", if it sees what a force does to the coarse mesh only
    prepared : whether it uses what was computed for each contact before, responses or meshes; see ``needs_contacts``
    reduces : "p2", if its answers come from responses of the fine quadratic elements, stored or learnt from; else ""
    place : the module whose ``prepare(case, model)`` makes what answers; of a user's own model its file
    called : its name in tables, where that is not the module's and no field is a part of it
    unsaid : the fields that are no part of what tables call its setting
    """

    law: ClassVar[str] = ""
    sees: ClassVar[str] = "load"
    prepared: ClassVar[bool] = False
    reduces: ClassVar[str] = ""
    place: ClassVar[str] = "a model"
    called: ClassVar[str] = ""
    unsaid: ClassVar[tuple[str, ...]] = ()

    @property
    def name(self) -> str:
        """What tables call it."""
        return self.called or self.place.rpartition(".")[2]

    @property
    def said(self) -> dict[str, int | float | str | bool]:
        """The fields that tables call its setting: those that are given, and switches only where they are off."""
        fields = ((name, getattr(self, name)) for name in type(self).model_fields if name not in self.unsaid)
        return {name: value for name, value in fields if value is not None and value is not True}

    @property
    def text(self) -> str:
        """Its setting as tables have it, such as "level=0, start=rest"."""
        return setting_text(self.said)

    def having(self, **changes: Any) -> Self:
        """Return the same model with other values of some fields, which are not checked."""
        return self.model_copy(update=changes)

    def tried(self, case: Case, grid: Any) -> Sequence[Model]:
        """Return what the trade-off tries, from cheap to expensive; ``grid`` has the values: ``tradeoff.settings``."""
        return [self]

    def prepare(self, case: Case) -> Solver:
        """Return what answers, timed; what other settings need too is made by ``case.share``.

        InputError or NotConverged if it cannot be prepared.
        """
        return import_module(self.place).prepare(case, self)

    def answer(self, body: Body, press: SurfacePress) -> Response:
        """Return the answer to one press of a body; what was prepared last is kept, and serves further presses.

        InputError for a model that learns from samples, which a body alone has not; NotConverged without an answer.

        ``FEM(order=1).answer(liver, SurfacePress(node=100, force_n=0.5, radius_m=0.02)).displacement_m``
        """
        if not isinstance(press, SurfacePress):
            raise InputError(f"{press!r} is no press; give Press(node=..., force_n=..., radius_m=...).")
        load = press.load_of(body)
        case = _alone(body, press.radius_m, (press.node,) if self.needs_contacts else ())
        solver = case.share(("solver", type(self), repr(self)), lambda: self.prepare(case))
        solver.precede(load)
        answer, doubt = answered(solver, load, case.n_surface)
        return Response(body, answer.displacement, answer.error, doubt)

    def law_of(self, case: Case) -> str:
        """Return the law of the material with which the model answers for the body of ``case``."""
        return case.body.material.law if self.law == BODYS else self.law

    @property
    def needs_contacts(self) -> bool:
        """Whether it answers prepared contacts only.

        Any model does whose ``coarse`` answer or ``start`` is the stored linear response, or whose ``target`` is the
        LIMIT to which stored responses are extrapolated.
        """
        start_points = getattr(self, "coarse", None), getattr(self, "start", None)
        return self.prepared or "linear" in start_points or getattr(self, "target", None) == LIMIT


@lru_cache(maxsize=2)
def _alone(body: Body, radius_m: float, stored: tuple[int, ...]) -> Case:
    """Return the case of a body without samples, with linear responses to unit forces at the nodes ``stored``."""
    case = Case.untrained(body, "press", radius_m, 1, 1e-8)
    if not stored:
        return case
    from palpate.solvers.compliance import compute_compliance

    return replace(case, response=compute_compliance(body, radius_m, contacts=np.array(stored), order=2))


LIMIT = "limit"
"""The target of settings that answer for ever finer levels, and not for the finest one, which is the operator."""
Kind = TypeVar("Kind", bound=Model)
BODYS = "the body's"
"""The law of models that take that of the body."""


class LeftOut(NotConverged):
    """A body of a kind that a model does not know: it is left out of the comparison, and has not failed."""


class OfBody(Protocol):
    """Any case of one body."""

    @property
    def body(self) -> Body: ...


def refuse_bed(case: OfBody, what: str) -> None:
    """Raise LeftOut for a body on an elastic bed, which ``what`` do not have."""
    if case.body.bed is not None:
        raise LeftOut(f"{what} have no elastic bed, which {case.body.name} lies on", [float("nan")])


def refuse_regions(case: OfBody, what: str) -> None:
    """Raise NotConverged for a body of several stiffnesses, of which ``what`` have one: all samples count as failed."""
    if case.body.regions is not None and not case.body.regions.is_one_stiffness:
        raise NotConverged(f"{what} have one stiffness, and the regions of {case.body.name} differ", [float("nan")])


def on_own_levels(case: OfBody, runs: Iterable[Any]) -> list[Setting]:
    """Return those of ``runs`` whose ``level`` the body has."""
    return [dict(each) for each in runs if each.level < len(case.body.levels)]


def training_counts(case: Case, shares: Iterable[float]) -> list[int]:
    """Return ``shares`` of the training samples as increasing whole numbers, at least 4 each, but 0 for the share 0."""
    return sorted({max(4, round(share * case.n_training)) if share else 0 for share in shares})


def distinct(models: Iterable[Kind]) -> list[Kind]:
    """Return ``models`` without those whose setting equals that of one before them."""
    model_of_text: dict[str, Kind] = {}
    for model in models:
        model_of_text.setdefault(model.text, model)
    return list(model_of_text.values())


def setting_text(setting: Setting) -> str:
    """Write a setting as tables have it, such as "iterations=2"."""
    return ", ".join(f"{name}={_short(value)}" for name, value in setting.items()) or "default"


def checked(answer: Any, n_surface: int, place: str = "a model") -> np.ndarray:
    """Return the displacement; InputError if it is not (n_surface, 3), NotConverged if a number in it is not finite.

    place : what the InputError names
    """
    displacement = getattr(answer, "displacement", answer)
    try:
        numbers = np.asarray(displacement, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{place}: the answer is no array of numbers; return ({n_surface}, 3) [m].") from None
    if numbers.shape != (n_surface, 3):
        raise InputError(f"{place}: the answer has the shape {numbers.shape}; return ({n_surface}, 3) [m].")
    if not np.isfinite(numbers).all():
        whose = f"{place}: " if place.endswith(".py") else ""  # a file of the user's
        raise NotConverged(f"{whose}the displacement has a value that is not finite", [float("nan")])
    return displacement


def answered(solver: Solver, load: Load, n_surface: int) -> tuple[Answer, str]:
    """Ask ``solver`` once; return the answer, ``checked``, and why the model itself doubts it, or ""."""
    try:
        answer, doubt = solver.respond(load), ""
    except Doubted as doubted:
        answer, doubt = doubted.answer, str(doubted)
    moved = checked(answer, n_surface)
    return answer if isinstance(answer, Answer) else Answer(moved), doubt


def _short(value: int | float | str | bool) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value).lower()


def held_mb(held: object) -> float:
    """Return the megabytes (1e6 bytes) of the arrays and sparse factors that ``held`` refers to, each counted once.

    References are followed through attributes, containers, partial calls and closures, but not into ``Kept``, which all
    models of a case share. Sparse LU factors count 12 bytes a stored number. Small objects and code do not count.
    """
    total = 0
    to_visit: list[Any] = [held]
    seen: dict[int, object] = {}  # the objects too, so that no number of one is given to another
    while to_visit:
        item = to_visit.pop()
        if isinstance(item, _PLAIN) or id(item) in seen:
            continue
        seen[id(item)] = item
        if isinstance(item, np.ndarray):
            if isinstance(item.base, np.ndarray):
                to_visit.append(item.base)
            else:
                total += item.nbytes
        elif type(item).__name__ == "SuperLU":
            total += 12 * item.nnz
        else:
            to_visit += _inside(item)
    return total / 1e6


def _inside(thing: object) -> list[object]:
    """Return the objects that ``thing`` refers to, as ``held_mb`` follows them."""
    if isinstance(thing, Kept | ModuleType) or type(thing).__module__.split(".")[0] in _FOREIGN:
        return []
    if isinstance(thing, dict):
        return list(thing.values())
    if isinstance(thing, list | tuple | set | frozenset):
        return list(thing)
    if isinstance(thing, partial):
        return [thing.func, thing.args, thing.keywords]
    if isinstance(thing, MethodType):
        return [thing.__self__]
    if isinstance(thing, FunctionType):
        return [cell.cell_contents for cell in thing.__closure__ or ()]
    slots = [getattr(thing, name, None) for name in getattr(type(thing), "__slots__", ())]
    return slots + list(getattr(thing, "__dict__", {}).values())
