"""Paper 3's claims on its composite tree: query time between sphere and AABB trees, precision near AABB trees."""

import numpy as np
import pandas as pd

from palpate.evaluation.enrichment.enrichment_claims import Claim

TIED = 0.05
"""Relative difference below which two times count as equal: repeated runs differ by as much."""
NEAR = 0.25
"""Relative excess of false pairs over the AABB tree that still counts as near it."""


def claims(collision: pd.DataFrame) -> pd.DataFrame:
    """Compute the rows of collision_claims.csv: each composite tree on each scene, and on all (geometric means).

    collision : the table of this name. The time is that of a query, which is the part that the paper compares. False
    pairs are those that reach the triangle test but do not cross, counted from 1, so that geometric means exist.
    """
    tested = collision[~collision["rival"].astype(bool)].fillna({"depths": ""})
    tested = tested.assign(false_pairs=1 + tested["triangle_tests"] - tested["pairs"])
    whole = tested.groupby(["structure", "depths"], sort=False)[["query_ms", "false_pairs"]].agg(_geometric)
    places = {scene: rows.set_index(["structure", "depths"]) for scene, rows in tested.groupby("scene", sort=False)}
    found = []
    for place, rows in {"all scenes": whole, **places}.items():
        for depths in [depths for structure, depths in rows.index if structure == "composite"]:
            found += _of(
                place, depths, *(rows.loc[key] for key in (("sphere", ""), ("composite", depths), ("aabb", "")))
            )
    return pd.DataFrame(found, columns=Claim._fields)


def _of(place: str, depths: str, sphere: pd.Series, composite: pd.Series, aabb: pd.Series) -> list[Claim]:
    """Evaluate both claims for one composite tree."""
    near = composite["false_pairs"] <= (1 + NEAR) * aabb["false_pairs"]
    times, false_pairs = (
        f"sphere {sphere[key]:.3g}{unit}, composite {composite[key]:.3g}{unit}, AABB {aabb[key]:.3g}{unit}"
        for key, unit in (("query_ms", " ms"), ("false_pairs", ""))
    )
    name = f"composite {depths}, {place}"
    return [
        Claim(f"query time ({name})", "between sphere and AABB", times, _between(sphere, composite, aabb)),
        Claim(f"false pairs ({name})", "near AABB", false_pairs, _verdict(near)),
    ]


def _geometric(values: pd.Series) -> float:
    return float(np.exp(np.log(values).mean()))


def _between(sphere: pd.Series, composite: pd.Series, aabb: pd.Series) -> str:
    """Judge a query time against those at both ends; it is tied if it equals one as far as times repeat."""
    time, *ends = (tree["query_ms"] for tree in (composite, sphere, aabb))
    if any(max(time, end) <= (1 + TIED) * min(time, end) for end in ends):
        return "tied"
    return _verdict(min(ends) < time < max(ends))


def _verdict(holds: bool) -> str:
    return "confirmed" if holds else "refuted"
