"""Limits of palpation: how deep in a slab, and how little stiffer than it, a ball may be to be felt by a finger."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from palpate.bodies.body import Body
from palpate.bodies.material import Tissue
from palpate.studies.palpation.ball_in_slab import ball_in_slab
from palpate.studies.palpation.press_curve import PressCurves

COLUMNS = ["cover_m", "ball_radius_m", "contrast", "force_n", "depth_m", "depth_without_m", "stiffer", "felt"]
COLUMNS += ["threshold", "products"]


def palpation_limits(
    slab: Mapping,
    ball_radius_m: float,
    covers_m: Sequence[float],
    contrasts: Sequence[float],
    radius_m: float,
    pressure_of_young: float,
    felt: float,
    progress: Callable = iter,
) -> pd.DataFrame:
    """Press a slab above a ball under each of ``covers_m`` [m] and of each of ``contrasts``: a table with COLUMNS.

    slab : as ``ball_in_slab`` takes it; contrast : modulus of the ball over that of the slab
    radius_m : of the finger; pressure_of_young : peak pressure of the press as a share of the slab's modulus
    stiffer, felt : as in ``palpation.palpate``; threshold : what is given as ``felt``
    products : with the stiffness matrix of the slab with the ball

    Raises InputError if a ball is not in the slab, NotConverged if a press has no equilibrium.
    """
    rows = []
    for cover in progress(covers_m):
        body = ball_in_slab(slab, ball_radius_m, cover, radius_m, contrasts[0])
        middle = np.array(slab["sizes_m"]) * [0.5, 0.5, 1.0]
        contact = int(np.argmin(np.linalg.norm(body.coarse.nodes - middle, axis=1)))
        plain = PressCurves(body, radius_m)
        forces = plain.forces([pressure_of_young])
        without = float(plain.depths(contact, forces, regions=False)[0])
        for contrast in contrasts:
            curves = PressCurves(stiffened(body, contrast), radius_m)
            depth = float(curves.depths(contact, forces, regions=True)[0])
            stiffer = without / depth - 1.0
            row = [cover, ball_radius_m, contrast, forces[0], depth, without, stiffer, abs(stiffer) >= felt]
            rows.append([*row, felt, curves.products])
    return pd.DataFrame(rows, columns=COLUMNS)


def stiffened(body: Body, contrast: float) -> Body:
    """Return the slab with a ball that is ``contrast`` times as stiff as the slab."""
    own = body.material
    materials = (own, replace(own, young_pa=contrast * own.young_pa))
    return replace(body, regions=Tissue(materials, body.tissue(0).region))


def least_contrasts(table: pd.DataFrame) -> dict[float, float]:
    """Return for each cover [m] of ``palpation_limits`` the least contrast that is felt, infinite if none is.

    Between two contrasts of the table ``stiffer`` is taken as linear in the logarithm of the contrast.
    """
    found = {}
    for cover, rows in table[table["contrast"] >= 1.0].groupby("cover_m"):
        rows = rows.sort_values("contrast")
        # a ball as stiff as the slab changes nothing
        stiffer, log = np.append(0.0, rows["stiffer"]), np.append(0.0, np.log(rows["contrast"]))
        edge = rows["threshold"].iloc[0]
        first = int(np.argmax(stiffer >= edge))
        if not first:
            found[float(cover)] = np.inf
            continue
        share = (edge - stiffer[first - 1]) / (stiffer[first] - stiffer[first - 1])
        found[float(cover)] = float(np.exp(log[first - 1] + share * (log[first] - log[first - 1])))
    return found
