"""The features by which paper 1's regressors compare coarse deformations, and the slots that fine ones are blended in.

The three kinds of paper 1, "Feature vector", share one form. At a contact they choose coarse nodes, an order of the
fine nodes, and axes; feature and slots are the displacements of those nodes, in that order, along those axes. Nodes are
ordered nearest first, the same on every run and every machine.
Ties: distances closer together than 1e-9 of the body's size count as equal, as on a symmetric mesh equal distances
differ in their last digits. Plain ordering then goes by node number, which is arbitrary: the same pattern round another
contact need not land in the same slots. The framed ordering goes by the position in a frame fixed to the contact's rest
normal, so there it does.
"""

from typing import NamedTuple

import numpy as np

from palpate.benchmark.database import Database
from palpate.errors import InputError

FEATURES = ("unordered", "ordered", "framed")  # kinds of feature vectors, which ``features_of`` makes
TIE = 1e-9  # lengths closer than this, relative to the body's size, are equal


def levels(values: np.ndarray, tolerance: float) -> np.ndarray:
    """Return integers (n,) that rank ``values`` (n,), equal for neighbours in their order within ``tolerance``.

    Rounding to multiples of the tolerance would part equal values that straddle a boundary; gaps do not.
    """
    order = np.argsort(values, kind="stable")
    level = np.empty(len(values), dtype=np.int64)
    level[order] = np.concatenate([[0], np.cumsum(np.diff(values[order]) > tolerance)])
    return level


def nearest_first(points: np.ndarray, contact: np.ndarray, size: float, frame: np.ndarray | None = None) -> np.ndarray:
    """Return the numbers of ``points`` (n, 3) [m] by distance from ``contact`` (3,) [m], nearest first.

    Ties within TIE of ``size`` [m] go by the position along the columns of ``frame``, if given, and then by number.
    """
    from_contact = points - contact
    distance = levels(np.linalg.norm(from_contact, axis=1), TIE * size)
    if frame is None:
        return np.argsort(distance, kind="stable")
    along = [levels(values, TIE * size) for values in (from_contact @ frame).T]
    return np.lexsort([*along[::-1], distance])


def body_axis(points: np.ndarray) -> np.ndarray:
    """Return the principal axis (3,) along which ``points`` (n, 3) spread most unlike along the others; z if none.

    On a body of revolution it is the axis of revolution. Its largest component is positive. The other two axes are not
    used: on such a body rounding alone decides where they point.
    """
    centred = points - points.mean(axis=0)
    spread, axes = np.linalg.eigh(centred.T @ centred)
    low_gap, high_gap = np.diff(spread)
    if max(low_gap, high_gap) < 1e-6 * spread[2]:
        return np.array([0.0, 0.0, 1.0])
    axis = axes[:, 2] if high_gap >= low_gap else axes[:, 0]
    return axis * np.sign(axis[np.abs(axis).argmax()])


def contact_frame(normal: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Return the frame of a contact: right-handed orthonormal columns (normal, tangent, binormal).

    The tangent is the first of ``directions`` (unit rows), and then of x, y and z, at more than 6° to the normal,
    projected into the tangent plane. With directions that turn with the body, frames of contacts that a turn of the
    body carries into each other are turned copies of each other.
    """
    tangents = np.vstack([directions, np.eye(3)])
    tangents = tangents - np.outer(tangents @ normal, normal)
    lengths = np.linalg.norm(tangents, axis=1)
    chosen = np.argmax(lengths > 0.1)
    tangent = tangents[chosen] / lengths[chosen]
    return np.column_stack([normal, tangent, np.cross(normal, tangent)])


class View(NamedTuple):
    """The coarse nodes, the order of fine nodes and the axes in which deformations are described at a contact.

    coarse : (r/3,) coarse node numbers of the feature
    slots : (n,) fine node in each slot, or None for mesh order
    places : (n,) slot of each fine node, the inverse of ``slots``
    frame : (3, 3) axes as columns, or None for the world's
    """

    coarse: np.ndarray
    slots: np.ndarray | None = None
    places: np.ndarray | None = None
    frame: np.ndarray | None = None

    def feature(self, coarse: np.ndarray) -> np.ndarray:
        """Return the feature vector (r,) [m] of the displacements of all coarse nodes, (N, 3) [m]."""
        chosen = coarse.take(self.coarse, axis=0)
        return (chosen if self.frame is None else chosen @ self.frame).ravel()

    def to_slots(self, fine: np.ndarray) -> np.ndarray:
        """Return displacements (n, 3) [m], in mesh order and world axes, in this contact's slots and axes, (3n,)."""
        ordered = fine if self.slots is None else fine[self.slots]
        return (ordered if self.frame is None else ordered @ self.frame).ravel()

    def from_slots(self, blended: np.ndarray) -> np.ndarray:
        """Invert ``to_slots``: bring (3n,) back into mesh order and world axes, (n, 3) [m]."""
        ordered = blended.reshape(-1, 3)
        if self.frame is not None:
            ordered = ordered @ self.frame.T
        return ordered if self.places is None else ordered.take(self.places, axis=0)


class Unordered:
    """All m coarse surface displacements in mesh order, r = 3m (the baseline, Seiler et al. 2012)."""

    def __init__(self, db: Database):
        self._view = View(db.coarse_surface)

    def view(self, contact: int) -> View:
        """Return the one view that all contacts share."""
        return self._view


class Ordered:
    """The ``neighbours`` coarse surface nodes nearest to the contact at rest, in that order.

    framed : whether ties go by the position in, and displacements are along, a frame fixed to the contact's rest
        normal; else node numbers and world axes decide
    The frame's tangent is the body's axis, or if the normal runs along that the direction from its centre. A contact's
    order is computed once, at its first use, so that no query sorts.
    """

    def __init__(self, db: Database, neighbours: int, framed: bool):
        self._surface = db.coarse_nodes[db.coarse_surface]
        self._numbers, self._normals = db.coarse_surface, db.contact_normals
        self._fine, self._size = db.nodes_fine_surface, db.size
        self._neighbours, self._framed = neighbours, framed
        self._axis, self._centre = body_axis(self._surface), self._surface.mean(axis=0)
        self._views: dict[int, View] = {}

    def view(self, contact: int) -> View:
        """Return the order, and frame if framed, of a coarse surface node; InputError if it is none."""
        if contact not in self._views:
            self._views[contact] = self._view_of(contact)
        return self._views[contact]

    def _view_of(self, contact: int) -> View:
        """Return the view of a contact: its nearest nodes in order and, if framed, its frame."""
        if contact not in self._numbers:
            raise InputError(f"enrichment: contact {contact} is not a coarse surface node; choose one that is.")
        row = np.searchsorted(self._numbers, contact)
        position, frame = self._surface[row], None
        if self._framed:
            outward = position - self._centre
            outward = outward / np.linalg.norm(outward)
            frame = contact_frame(self._normals[row], np.array([self._axis, outward]))
        nearest, slots = (nearest_first(nodes, position, self._size, frame) for nodes in (self._surface, self._fine))
        return View(self._numbers[nearest[: self._neighbours]], slots, np.argsort(slots), frame)


Features = Unordered | Ordered


def features_of(db: Database, kind: str, neighbours: int) -> Features:
    """Make one ``kind`` of feature, of those in FEATURES; neighbours : coarse nodes in those that are ordered."""
    return Unordered(db) if kind == "unordered" else Ordered(db, neighbours, framed=kind == "framed")


def describe(
    features: Features, contact: np.ndarray, coarse: np.ndarray, fine: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the feature vectors (k, r) and the slots (k, 3n) [m] of k samples.

    contact : (k,); coarse, fine : displacements of all coarse and of the fine surface nodes, (k, N, 3) and (k, n, 3)
    """
    views = [features.view(int(c)) for c in contact]
    described = np.array([view.feature(x) for view, x in zip(views, coarse, strict=True)])
    return described, np.array([view.to_slots(x) for view, x in zip(views, fine, strict=True)])
