"""Choose presses whose truth a run has simulated, for a reader to put answers beside."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from palpate.benchmark.presses import force_of
from palpate.benchmark.truth import OWN, load_truth
from palpate.bodies.body import Body
from palpate.bodies.contacts import kept_contacts, spread_out


@dataclass(frozen=True, eq=False)
class Known:
    """A press and its truth.

    contact : coarse node; place : its triangle of the fine surface, and the weights of its corners
    force : (3,) [N]; displacement : (n, 3) [m] of the fine surface; own : the truth's own error, RMSE over peak
    """

    contact: int
    place: dict
    force: np.ndarray
    displacement: np.ndarray
    own: float

    @property
    def press(self) -> dict:
        """The press as portable models take it."""
        return self.place | {"force": [float(part) for part in self.force]}


def place_of(body: Body, node: int) -> dict:
    """Return the place of a fine surface node: the number of a triangle, and the weights (3,) of its corners."""
    triangle = int(np.flatnonzero((body.fine.triangles == node).any(axis=1))[0])
    return {"triangle": triangle, "weights": (body.fine.triangles[triangle] == node).astype(float).tolist()}


def known_presses(body: Body, truths: Sequence[Path | str], loads: Sequence[Path | str], count: int) -> list[Known]:
    """Return at most ``count`` believed presses, the hardest of each contact, at contacts well spread over the body.

    truths, loads : files of the same regimes, truth.h5 and loads.csv
    """
    found: dict[int, Known] = {}
    for truth_file, load_file in zip(truths, loads, strict=True):
        truth, table = load_truth(truth_file), pd.read_csv(load_file).set_index("sample", drop=False)
        for i in np.flatnonzero(truth.believed):
            contact, force = int(truth.contact[i]), force_of(table.loc[truth.sample[i]])
            if contact in found and np.linalg.norm(found[contact].force) >= np.linalg.norm(force):
                continue
            own = float(truth.own[i, OWN.index("rmse_of_peak")])
            found[contact] = Known(contact, place_of(body, contact), force, truth.displacement[i], own)
    return [found[contact] for contact in _spread(body, list(found), count)]


def _spread(body: Body, contacts: list[int], count: int) -> list[int]:
    """Choose ``count`` of ``contacts``, each far from those before it."""
    if not contacts:
        return []
    points = body.fine.nodes[contacts]
    first = int(np.argmax(np.linalg.norm(points - points.mean(axis=0), axis=1)))
    rows = [first, *spread_out(points, points[[first]], min(count, len(contacts)) - 1)]
    return [contacts[row] for row in rows]


def trial_presses(body: Body, count: int, depth_m: float) -> list[dict]:
    """Return straight presses to ``depth_m`` [m] at ``count`` contacts, where no truth is known."""
    contacts = kept_contacts(body, count)
    return [place_of(body, int(node)) | {"moved": (-depth_m * body.fine.normals[node]).tolist()} for node in contacts]
