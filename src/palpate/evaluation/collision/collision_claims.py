"""Paper 3 on its composite tree: as fast as between sphere and AABB trees, and about as precise as AABB trees."""

import numpy as np
import pandas as pd

from palpate.evaluation.enrichment.enrichment_claims import Claim

TIED = 0.05
"""Times that differ by less than this much are on a par: repeated runs differ by as much."""
NEAR = 0.25
"""How many more false pairs than the AABB tree's count as near it."""


def claims(collision: pd.DataFrame) -> pd.DataFrame:
    """Rows of collision_claims.csv: each composite tree on each scene, and on all (geometric means).

    collision : the table of this name. Time is that of a query, the part that the paper compares. False pairs are
    those passed to the triangle test that do not cross, counted from 1 so that none is not infinitely good.
    """
    ours = collision[~collision["rival"].astype(bool)].fillna({"depths": ""})
    ours = ours.assign(false_pairs=1 + ours["triangle_tests"] - ours["pairs"])
    whole = ours.groupby(["structure", "depths"], sort=False)[["query_ms", "false_pairs"]].agg(_geometric)
    places = {scene: rows.set_index(["structure", "depths"]) for scene, rows in ours.groupby("scene", sort=False)}
    found = []
    for place, rows in {"all scenes": whole, **places}.items():
        for depths in [depths for structure, depths in rows.index if structure == "composite"]:
            found += _of(
                place, depths, *(rows.loc[key] for key in (("sphere", ""), ("composite", depths), ("aabb", "")))
            )
    return pd.DataFrame(found, columns=Claim._fields)


def _of(place: str, depths: str, sphere: pd.Series, composite: pd.Series, aabb: pd.Series) -> list[Claim]:
    """Both claims about one composite tree."""
    ends = sorted([sphere["query_ms"], aabb["query_ms"]])
    between = ends[0] * (1 - TIED) <= composite["query_ms"] <= ends[1] * (1 + TIED)
    near = composite["false_pairs"] <= (1 + NEAR) * aabb["false_pairs"]
    times, wrong = (
        f"sphere {sphere[key]:.3g}{unit}, composite {composite[key]:.3g}{unit}, AABB {aabb[key]:.3g}{unit}"
        for key, unit in (("query_ms", " ms"), ("false_pairs", ""))
    )
    name = f"composite {depths}, {place}"
    return [
        Claim(f"query time ({name})", "between sphere and AABB", times, _verdict(between)),
        Claim(f"false pairs ({name})", "near AABB", wrong, _verdict(near)),
    ]


def _geometric(values: pd.Series) -> float:
    return float(np.exp(np.log(values).mean()))


def _verdict(holds: bool) -> str:
    return "confirmed" if holds else "refuted"
