"""Decide which nodes of a body can be pressed, and refuse the others."""

from typing import NoReturn

import numpy as np

from palpate.bodies.body import Body
from palpate.errors import InputError


def contacts_of(body: Body) -> np.ndarray:
    """Return the nodes that can be pressed, in increasing order: coarse surface nodes that no anchor holds."""
    return np.setdiff1d(body.coarse.surface, body.anchors[0])


def row_of(contacts: np.ndarray, contact: int, place: str = "") -> int:
    """Return where ``contact`` stands in ``contacts``, as ``contacts_of`` gives them; InputError if it does not."""
    row = int(np.searchsorted(contacts, contact))
    if row == len(contacts) or contacts[row] != contact:
        refuse(contact, place)
    return row


def refuse(contact: int, place: str = "") -> NoReturn:
    """Raise the InputError of a node that cannot be pressed; its sentence begins with ``place``."""
    raise InputError(f"{place}contact {contact} is not a free surface node of the coarse mesh; choose one that is.")
