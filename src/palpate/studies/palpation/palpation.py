"""Palpation of a body with regions: force against depth at several places, with the regions and without them."""

from collections.abc import Callable, Sequence

import numpy as np
import pandas as pd
from scipy.spatial import cKDTree

from palpate.bodies.body import Body
from palpate.bodies.contacts import contacts_of, pressed_contacts
from palpate.errors import InputError
from palpate.studies.palpation.press_curve import PressCurves

COLUMNS = ["body", "contact", "cover_m", "force_n", "depth_m", "depth_without_m", "stiffer", "felt", "threshold"]


def palpate(
    body: Body,
    radius_m: float,
    places: int,
    pressures_of_young: Sequence[float],
    felt: float,
    progress: Callable = iter,
) -> pd.DataFrame:
    """Press at ``places`` contacts, from above a region outwards; one row a force, with COLUMNS.

    pressures_of_young : peak pressures of a press as shares of the body's own modulus
    cover_m : distance from the place to the elements of a region, 0 where they reach it
    depth_without_m : depth of the press on the body of its own material alone
    stiffer : by what share the place resists more than without regions, the ratio of the depths minus 1
    felt : from what ``stiffer`` on a finger feels the difference, ``threshold`` in the table, where ``felt`` is whether
        it does

    Raises InputError if the body has no regions; NotConverged if a press has no equilibrium.
    """
    if body.regions is None:
        raise InputError(f"bodies.{body.name} has no regions, so there is nothing to feel; give it some.")
    contacts, covers = choose_places(body, places)
    curves, rows = PressCurves(body, radius_m), []
    forces = curves.forces(sorted(pressures_of_young))
    for contact, cover in progress(list(zip(contacts, covers, strict=True))):
        with_regions, without = (curves.depths(int(contact), forces, regions) for regions in (True, False))
        stiffer = without / with_regions - 1.0
        columns = (forces, with_regions, without, stiffer, np.abs(stiffer) >= felt)
        rows += [[body.name, int(contact), cover, *row, felt] for row in zip(*columns, strict=True)]
    return pd.DataFrame(rows, columns=COLUMNS)


def choose_places(body: Body, places: int) -> tuple[np.ndarray, np.ndarray]:
    """Choose the contact nearest to a region and others ever farther from it on the same side, and their distances [m].

    Their distances are spread evenly, up to half of the body's size.
    """
    contacts = pressed_contacts(body, contacts_of(body))
    stiff, at = body.fine.tetrahedra[body.tissue(-1).region > 0], body.coarse.nodes[contacts]
    # to the middles of elements, of which one is nearest where several places touch or lie as deep
    distance = cKDTree(body.fine.nodes[stiff].mean(axis=1)).query(at)[0]
    cover = cKDTree(body.fine.nodes[np.unique(stiff)]).query(at)[0]
    nearest = contacts[np.argmin(distance)]
    side = body.fine.normals[contacts] @ body.fine.normals[nearest] > 0.0
    contacts, distance, cover = contacts[side], distance[side], cover[side]
    wanted = np.linspace(distance.min(), min(distance.max(), body.coarse.size / 2), places)
    chosen = np.unique(np.abs(distance - wanted[:, None]).argmin(axis=1))
    chosen = chosen[np.argsort(distance[chosen])]
    return contacts[chosen], cover[chosen]
