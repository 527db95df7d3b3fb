"""Define a model, two functions ``settings`` and ``prepare``, and the case that it may see before it is asked."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import NamedTuple, Protocol

import numpy as np

from palpate.bodies.body import Body
from palpate.enrichment.training_samples import FitOptions
from palpate.errors import InputError, NotConverged
from palpate.samples.database import Database
from palpate.solvers.compliance import Compliance

Setting = dict[str, int | float | str | bool]


@dataclass(frozen=True, eq=False)
class Case:
    """One body in one regime of loads, and all that a model may learn from: no test sample is in here.

    radius_m : of the disc that a force is spread over; 0 presses on one node
    database, response : what ``training``, ``meshes`` and ``compliance`` are made of; models look at those
    options : how what is learnt is fitted; its ``seed`` is for every random choice
    tolerance : relative residual at which run-time solves stop
    samples_s : (k,) what simulating each training sample took [s]
    used : what was looked at, with its cost [s]; the evaluation adds it to the offline time
    """

    body: Body
    regime: str
    radius_m: float
    database: Database
    response: Compliance | None
    options: FitOptions
    tolerance: float
    samples_s: np.ndarray
    used: dict[str, float] = field(default_factory=dict)

    @property
    def training(self) -> Database:
        """The k training samples: contact (k,), force (k, 3) [N], fine (k, n_surface, 3) [m], coarse_live …"""
        self.used["training"] = max(float(self.samples_s.sum()), self.used.get("training", 0.0))
        return self.database

    @property
    def meshes(self) -> Database:
        """The same without any sample: fine surface, coarse mesh, interpolation between them. Costs nothing."""
        return rows_of(self.database, np.empty(0, dtype=int))

    @property
    def compliance(self) -> Compliance:
        """Linear responses to unit forces at every contact; InputError where the case has none."""
        if self.response is None:
            raise InputError(f"{self.body.name}: this case has no compliance; compute it, or leave out what needs it.")
        self.used["compliance"] = self.response.seconds
        return self.response

    @property
    def n_surface(self) -> int:
        """Fine surface nodes, whose displacements are asked for."""
        return len(self.database.nodes_fine_surface)

    @property
    def n_training(self) -> int:
        """How many training samples there are; asking costs nothing."""
        return len(self.database.contact)

    def first(self, count: int) -> "Case":
        """The same with ``count`` training samples of a seeded order: smaller choices are part of larger ones."""
        order = np.random.default_rng(self.options.seed).permutation(self.n_training)
        rows = np.sort(order[:count])
        return replace(self, database=rows_of(self.database, rows), samples_s=self.samples_s[rows])


class Solver(Protocol):
    """A prepared model; ``memory_mb`` is what it holds [MB], asked for after the queries: ``memory.held_mb`` counts."""

    memory_mb: float

    def respond(self, contact: int, force: np.ndarray) -> np.ndarray:
        """Displacement (n_surface, 3) [m] of the fine surface nodes under ``force`` (3,) [N] at a coarse node.

        Raises NotConverged rather than return what was not checked.
        """


class Model(NamedTuple):
    """A way of simulating.

    settings(case) : settings from cheap to dear, at least five where the model has a setting, else [{}]
    prepare(case, setting) : offline work, timed; InputError or NotConverged if it cannot be done
    """

    settings: Callable[[Case], list[Setting]]
    prepare: Callable[[Case, Setting], Solver]


def rows_of(db: Database, rows: np.ndarray) -> Database:
    """``db`` with some of its samples only."""
    names = ("contact", "force", "fine", "coarse_paper", "coarse_live", "residual")
    return replace(db, **{name: getattr(db, name)[rows] for name in names})


def setting_text(setting: Setting) -> str:
    """A setting as tables have it, such as "iterations=2"."""
    return ", ".join(f"{name}={_short(value)}" for name, value in setting.items()) or "default"


def checked(displacement: np.ndarray, n_surface: int) -> np.ndarray:
    """``displacement``; InputError if it is not (n_surface, 3), NotConverged if a number in it is not finite."""
    if np.shape(displacement) != (n_surface, 3):
        raise InputError(f"a model answered with shape {np.shape(displacement)}; return ({n_surface}, 3) [m].")
    if not np.isfinite(displacement).all():
        raise NotConverged("the displacement has a value that is not finite", [float("nan")])
    return displacement


def _short(value: int | float | str | bool) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value).lower()
