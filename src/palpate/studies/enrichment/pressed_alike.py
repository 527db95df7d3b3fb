"""Find the feature vectors of the same press at two nodes, as paper 1's figure 2 shows them."""

import numpy as np
import pandas as pd

from palpate.benchmark.database import Database
from palpate.models.enrichment.features import kinds

ALIKE_RAD = np.radians(5.0)
"""Angle between two presses up to which they have the same direction."""


def choose_alike(db: Database) -> tuple[int, int]:
    """Choose two samples with different contacts, in the middle of those there are: pressed in directions within 5°
    and far apart; if no two are as near, those that are nearest.
    """
    points = db.coarse_nodes[db.contact]
    along = db.force / np.linalg.norm(db.force, axis=1, keepdims=True)
    apart = np.linalg.norm(points[:, None] - points[None], axis=2)
    angle = np.arccos(np.clip(along @ along.T, -1.0, 1.0))
    # the ends and edges of a body are unlike its middle
    outer = apart.mean(axis=1) > np.median(apart.mean(axis=1))
    unlike = outer[:, None] | outer[None] | (apart == 0.0)
    angle[unlike] = np.inf
    alike = angle <= ALIKE_RAD
    best = np.argmax(np.where(alike, apart, -1.0)) if alike.any() else np.argmin(angle)
    first, second = np.unravel_index(best, apart.shape)
    return int(first), int(second)


def feature_rows(db: Database, neighbours: int) -> pd.DataFrame:
    """Tabulate each kind of feature of two samples that are pressed alike: features, press, contact, node, axis …

    node : place of a coarse node in the vector; axis : 0, 1 or 2, of the world or of the contact's own frame
    share_of_peak : displacement over the largest one of the sample
    """
    tables = []
    for name, kind in kinds(db, neighbours).items():
        for press, sample in enumerate(choose_alike(db), 1):
            contact = int(db.contact[sample])
            vector = kind.view(contact).feature(db.coarse_paper[sample]) / db.peaks[sample]
            node, axis = np.divmod(np.arange(len(vector)), 3)
            row = {"features": name, "press": press, "contact": contact, "node": node, "axis": axis}
            tables.append(pd.DataFrame(row | {"share_of_peak": vector}))
    return pd.concat(tables)
