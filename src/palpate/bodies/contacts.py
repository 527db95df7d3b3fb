"""Decide which nodes of a body can be pressed, which of them are kept, and refuse the others."""

from typing import NoReturn

import numpy as np

from palpate.bodies.bed import inner_nodes
from palpate.bodies.body import Body
from palpate.errors import InputError


def contacts_of(body: Body) -> np.ndarray:
    """Return the nodes that can be pressed, in increasing order: coarse surface nodes that no anchor holds."""
    return np.setdiff1d(body.coarse.surface, body.anchors[0])


def kept_contacts(body: Body, count: int | None) -> np.ndarray:
    """Return the contacts to prepare, in increasing order: all, or ``count`` of those that samples press, well spread.

    The first is the one farthest from the middle of all, each next one the farthest from those before it. A body that
    has fewer gives all that it has.
    """
    if count is None:
        return contacts_of(body)
    able = pressed_contacts(body, contacts_of(body))
    points = body.coarse.nodes[able]
    distance = np.linalg.norm(points - points.mean(axis=0), axis=1)
    chosen: list[int] = []
    for _ in range(min(count, len(able))):
        chosen.append(int(np.argmax(distance)))
        near = np.linalg.norm(points - points[chosen[-1]], axis=1)
        distance = near if len(chosen) == 1 else np.minimum(distance, near)
    return np.sort(able[chosen])


def pressed_contacts(body: Body, contacts: np.ndarray) -> np.ndarray:
    """Return those of ``contacts`` that no element joins to a held node, beside which the anchor would be pressed.

    Nodes on the bed, where something is in the way, are left out, too.
    """
    elements = body.coarse.tetrahedra
    able = np.setdiff1d(contacts, elements[np.isin(elements, body.anchors[0]).any(axis=1)])
    return able if body.bed is None else np.setdiff1d(able, inner_nodes(body.coarse, body.bed))


def row_of(contacts: np.ndarray, contact: int, place: str = "") -> int:
    """Return where ``contact`` stands in ``contacts``, which increase; InputError if it does not."""
    row = int(np.searchsorted(contacts, contact))
    if row == len(contacts) or contacts[row] != contact:
        refuse(contact, place)
    return row


def refuse(contact: int, place: str = "") -> NoReturn:
    """Raise the InputError of a node that cannot be pressed; its sentence begins with ``place``."""
    raise InputError(
        f"{place}contact {contact} is not a free surface node of the coarse mesh, or not one of the contacts that are "
        "prepared; choose one that is."
    )
