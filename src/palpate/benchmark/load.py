"""Loads that models are asked about: presses on the surface, one or several at once, by a force or to a depth."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from palpate.errors import InputError, NotConverged
from palpate.setting_types import Block, Index, NotNegative, Positive, Vector, key

if TYPE_CHECKING:
    from pathlib import Path

    from palpate.bodies.body import Body

PREPARED, NEW, TWO, DEPTH = "prepared", "never prepared", "two contacts", "depth"
LOADS = (PREPARED, NEW, TWO, DEPTH)
"""Kinds of load: at a prepared contact, at another place, at two at once, and a disc that is pushed to a depth."""


class Refused(NotConverged):
    """A load that a model cannot answer, whatever its numbers; the message names the model's limit."""

    def __init__(self, message: str):
        super().__init__(message, [float("nan")])


@dataclass(frozen=True, eq=False)
class Press:
    """A press on a disc of the case's radius around a node of the fine surface, by a force or to a displacement.

    node : its number on the finest level; contacts are those that are nodes of the coarse mesh, too
    force : (3,) [N], or None where ``moved`` is given and the force is to be found
    moved : (3,) [m], mean displacement of the disc with the weights of its pressure; or None
    InputError unless one of both is given, and for a number that is not finite.
    """

    node: int
    force: np.ndarray | None = None
    moved: np.ndarray | None = None

    def __post_init__(self) -> None:
        given = [each for each in (self.force, self.moved) if each is not None]
        if len(given) != 1:
            raise InputError(f"the press at node {self.node} needs either a force or a displacement; give one of them.")
        if not np.isfinite(given[0]).all():
            raise InputError(f"the press at node {self.node} has a number that is not finite; give finite ones.")


@dataclass(frozen=True, eq=False)
class Load:
    """All presses that act at once, of which there is one at least."""

    presses: tuple[Press, ...]

    def __post_init__(self) -> None:
        if not self.presses:
            raise InputError("a load without a press asks for nothing; give it one.")

    @staticmethod
    def at(node: int, force: np.ndarray) -> "Load":
        """Return the load of one ``force`` (3,) [N] at a node."""
        return Load((Press(int(node), force),))

    def alone(self) -> Press:
        """Return the press of a load that is one, by force or to a depth; Refused for several."""
        if len(self.presses) != 1:
            raise Refused("one press at a time is answered, and not several")
        return self.presses[0]

    def single(self) -> tuple[int, np.ndarray]:
        """Return node and force (3,) [N] of a load that is one force; Refused for any other."""
        self.alone()
        return self.forces()[0]

    def forces(self) -> list[tuple[int, np.ndarray]]:
        """Return node and force (3,) [N] of each press; Refused if one is pushed to a depth."""
        given, pushed = self.parted()
        if pushed:
            raise Refused("forces are answered, and not a depth that a disc is pushed to")
        return given

    def parted(self) -> tuple[list[tuple[int, np.ndarray]], list[tuple[int, np.ndarray]]]:
        """Return node and force (3,) [N] of the presses by force, and node and displacement (3,) [m] of others."""
        given = [(press.node, press.force) for press in self.presses if press.force is not None]
        return given, [(p.node, p.moved) for p in self.presses if p.force is None and p.moved is not None]

    def with_found(self, forces: np.ndarray) -> np.ndarray:
        """Return the force of every press, (presses, 3) [N]; forces : those of the presses to a depth, in order."""
        found = iter(forces)
        return np.array([next(found) if press.force is None else press.force for press in self.presses])

    def times(self, factor: float) -> "Load":
        """Return the load with every force or displacement times ``factor``."""
        return Load(tuple(Press(p.node, _times(factor, p.force), _times(factor, p.moved)) for p in self.presses))

    @property
    def key(self) -> tuple[bytes | int, ...]:
        """Nodes, forces and displacements as a hashable key, which is equal for equal loads."""
        parts: list[bytes | int] = []
        for press in self.presses:
            parts += [press.node, *(b"" if given is None else given.tobytes() for given in (press.force, press.moved))]
        return tuple(parts)


class SurfacePress(Block):
    """A force that is spread over a disc of a body's surface: what ``Model.answer`` is asked."""

    node: Index = key("Number of the node of the fine surface in the middle of the disc")
    force_n: Positive = key("Size of the force [N], which acts along direction")
    radius_m: NotNegative = key("Radius of the disc [m]; 0 presses on the node alone", 0.0)
    direction: Vector | None = key("Direction of the force, of any length; null: the inward normal", None)

    def load_of(self, body: "Body") -> Load:
        """Return the press as a load; InputError for a node off the surface, a disc too large, and no direction."""
        if not hasattr(body, "fine"):
            raise InputError(f"{type(body).__name__} is no body; give what its make() returns, once for all presses.")
        if self.node not in body.fine.surface:
            raise InputError(f"node {self.node} is not on the surface of {body.name}; give one of its fine.surface.")
        if self.radius_m > body.fine.size:
            raise InputError(
                f"radius_m of the press is {self.radius_m:g} m, and {body.name} is {body.fine.size:.3g} m long; "
                "give the radius of what presses it, in metres."
            )
        direction = -body.fine.normals[self.node] if self.direction is None else np.array(self.direction, dtype=float)
        if not np.linalg.norm(direction) > 0.0:
            raise InputError(f"the press at node {self.node} has no direction; give one with a length.")
        return Load.at(self.node, self.force_n * direction / np.linalg.norm(direction))


@dataclass(frozen=True, eq=False)
class Response:
    """A model's answer about a ``body``.

    displacement_m : (n_surface, 3) [m] of the fine surface nodes, ``body.fine.surface``
    estimated_error : the model's own estimate of its error, as RMSE over peak; or None
    doubt : why the model does not believe its answer, or ""
    """

    body: "Body"
    displacement_m: np.ndarray
    estimated_error: float | None = None
    doubt: str = ""

    def __repr__(self) -> str:
        doubt = f", doubted: {self.doubt}" if self.doubt else ""
        return f"<Response of {self.body.name}: {len(self.displacement_m)} nodes, peak {self.peak_m:.3g} m{doubt}>"

    @property
    def peak_m(self) -> float:
        """The largest displacement [m]."""
        return float(np.linalg.norm(self.displacement_m, axis=1).max())

    def plot(self, path: "str | Path | None" = None) -> bytes:
        """Draw the surface as it is moved, coloured by how far; return the PNG, and write it to ``path``."""
        from palpate import pictures

        return pictures.response(self, path)

    def _repr_png_(self) -> bytes:
        return self.plot()

    def error(self, other: "Response") -> float:
        """Return the RMSE against ``other``, over its peak; InputError unless both are of the same surface."""
        if not isinstance(other, Response):
            raise InputError(f"an error is that against another response, and not against {other!r}.")
        nodes, theirs = (each.body.fine.nodes[each.body.fine.surface] for each in (self, other))
        if not np.array_equal(nodes, theirs):
            raise InputError(
                f"the responses are of surfaces of {len(nodes)} and {len(theirs)} nodes that differ; ask both models "
                "about one body, at any of its levels."
            )
        squares = np.sum((self.displacement_m - other.displacement_m) ** 2, axis=1)
        return float(np.sqrt(np.mean(squares)) / other.peak_m)


class Answer(NamedTuple):
    """The answer of a model that returns more than displacements.

    displacement : (n_surface, 3) [m] of the fine surface
    forces : (presses, 3) [N], found for discs that are pushed to a depth, given for others; or None
    error : the model's own estimate of its error, as RMSE over peak; or None
    """

    displacement: np.ndarray
    forces: np.ndarray | None = None
    error: float | None = None


class Doubted(NotConverged):
    """Raised with an answer that its model does not believe, by which doubts can be judged; it is not to be used."""

    def __init__(self, message: str, residuals: list[float], answer: Answer):
        super().__init__(message, residuals)
        self.answer = answer


def displacement_of(answer: np.ndarray | Answer) -> np.ndarray:
    """Return the displacement (n_surface, 3) [m] of a model's answer of either kind."""
    return answer.displacement if isinstance(answer, Answer) else answer


def loads_of(nodes: Sequence[int] | np.ndarray, forces: np.ndarray) -> list[Load]:
    """Return one load of one force for each of the k ``nodes``; ``forces`` (k, 3) [N]."""
    return [Load.at(int(node), force) for node, force in zip(nodes, forces, strict=True)]


def _times(factor: float, given: np.ndarray | None) -> np.ndarray | None:
    return None if given is None else factor * given
