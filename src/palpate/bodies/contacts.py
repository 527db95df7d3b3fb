"""Find the nodes of a body that can be pressed, choose some of them, and refuse other nodes."""

from typing import NoReturn

import numpy as np
from scipy.spatial import cKDTree

from palpate.bodies.body import Body
from palpate.bodies.supports import inner_nodes
from palpate.errors import InputError


def contacts_of(body: Body) -> np.ndarray:
    """Return the nodes that can be pressed, in increasing order: coarse surface nodes that no anchor holds."""
    return np.setdiff1d(body.coarse.surface, body.anchors[0])


def surface_contacts(body: Body) -> np.ndarray:
    """Return all nodes that can be pressed, in increasing order: those of the fine surface that no anchor holds."""
    return np.setdiff1d(body.fine.surface, body.anchors[len(body.levels) - 1])


def kept_contacts(body: Body, count: int | None) -> np.ndarray:
    """Return the contacts to prepare, increasing: all, or ``count`` of those that samples press, spread far apart.

    The first is the one farthest from the middle of all, each next one the farthest from those before it. A body that
    has fewer gives all that it has.
    """
    if count is None:
        return contacts_of(body)
    pressed = pressed_contacts(body, contacts_of(body))
    return np.sort(pressed[spread_over(body.coarse.nodes[pressed], count)]) if len(pressed) else pressed


def contacts_by_area(body: Body, count: int, seed: int) -> np.ndarray:
    """Draw ``count`` contacts that samples may press, or all if fewer, in order; chances are in proportion to areas."""
    pressed = pressed_contacts(body, contacts_of(body))
    # first arrivals of Poisson processes: a larger count only adds contacts (Efraimidis and Spirakis 2006)
    arrivals = np.random.default_rng(seed).exponential(size=len(pressed)) / body.coarse.areas[pressed]
    return pressed[np.argsort(arrivals)[:count]]


def sampled_contacts(body: Body, count: int | None, seed: int) -> np.ndarray:
    """Choose contacts to press, in increasing order: all, or ``count``, half well spread and half drawn by area.

    Those that lie farthest from each other are rims and corners; a finger falls on faces and the middles of ends, too.
    A body that has fewer gives all.
    """
    if count is None:
        return kept_contacts(body, None)
    spread = kept_contacts(body, -(-count // 2))
    drawn = contacts_by_area(body, count + len(spread), seed)
    return np.sort(np.append(spread, drawn[~np.isin(drawn, spread)][: count - len(spread)]))


def places_between(body: Body, count: int, known: np.ndarray) -> np.ndarray:
    """Choose ``count`` fine surface nodes (k,) that are no coarse ones, each the farthest from all before it.

    known : nodes (m,) that they are to be far from, too
    They lie between coarse nodes that ``pressed_contacts`` lets be pressed; a body that has fewer gives all.
    """
    candidates = between_contacts(body)
    candidates = candidates[candidates >= len(body.coarse.nodes)]
    nodes = body.fine.nodes
    return candidates[spread_out(nodes[candidates], nodes[known], min(count, len(candidates)))]


def between_contacts(body: Body) -> np.ndarray:
    """Return the fine surface nodes, increasing, that lie between coarse nodes of ``pressed_contacts``."""
    pressed = np.zeros(len(body.coarse.nodes))
    pressed[pressed_contacts(body, contacts_of(body))] = 1.0
    return body.fine.surface[(body.prolongation @ pressed)[body.fine.surface] > 1.0 - 1e-9]


def spread_over(points: np.ndarray, count: int) -> list[int]:
    """Choose ``count`` rows of ``points`` (n, 3), or all: the farthest from their middle, then by ``spread_out``."""
    farthest = int(np.argmax(np.linalg.norm(points - points.mean(axis=0), axis=1)))
    return [farthest, *spread_out(points, points[[farthest]], min(count, len(points)) - 1)]


def spread_out(points: np.ndarray, known: np.ndarray, count: int) -> list[int]:
    """Choose ``count`` rows of ``points`` (n, 3), each the farthest from those before it and from ``known`` (m, 3)."""
    distance = np.min([np.linalg.norm(points - place, axis=1) for place in known], axis=0)
    chosen: list[int] = []
    for _ in range(count):
        chosen.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return chosen


def pressed_contacts(body: Body, contacts: np.ndarray) -> np.ndarray:
    """Return those of ``contacts`` that samples press: not those on the bed or beside a held node."""
    elements = body.coarse.tetrahedra
    free = np.setdiff1d(contacts, elements[np.isin(elements, body.anchors[0]).any(axis=1)])
    return free if body.bed is None else np.setdiff1d(free, inner_nodes(body.coarse, body.bed))


def row_of(contacts: np.ndarray, contact: int, place: str = "") -> int:
    """Return where ``contact`` stands in ``contacts``, which increase; InputError if it does not."""
    row = int(np.searchsorted(contacts, contact))
    if row == len(contacts) or contacts[row] != contact:
        refuse(contact, place)
    return row


def refuse(contact: int, place: str = "") -> NoReturn:
    """Raise the InputError of a node that cannot be pressed; its sentence begins with ``place``."""
    raise InputError(
        f"{place}contact {contact} is not a free surface node of the mesh that is pressed, or not one of the contacts "
        "that are prepared; choose one that is."
    )


def contacts_near_regions(body: Body, places: int) -> tuple[np.ndarray, np.ndarray]:
    """Choose ``places`` contacts at growing distances from a region, on the side where it is nearest to the surface.

    Their distances are spread evenly, up to half of the body's size.
    Returns the contacts and their distances [m] from the region's nodes, (places,) or fewer.
    """
    contacts = pressed_contacts(body, contacts_of(body))
    region_elements, points = body.fine.tetrahedra[body.tissue(-1).region > 0], body.coarse.nodes[contacts]
    # to the middles of elements: of several nodes that are as near, one of an element's is nearest
    to_middles = cKDTree(body.fine.nodes[region_elements].mean(axis=1)).query(points)[0]
    to_nodes = cKDTree(body.fine.nodes[np.unique(region_elements)]).query(points)[0]
    nearest = contacts[np.argmin(to_middles)]
    same_side = body.fine.normals[contacts] @ body.fine.normals[nearest] > 0.0
    contacts, to_middles, to_nodes = contacts[same_side], to_middles[same_side], to_nodes[same_side]
    wanted_m = np.linspace(to_middles.min(), min(to_middles.max(), body.coarse.size / 2), places)
    chosen = np.unique(np.abs(to_middles - wanted_m[:, None]).argmin(axis=1))
    chosen = chosen[np.argsort(to_middles[chosen])]
    return contacts[chosen], to_nodes[chosen]
