"""Judge paper 3's claims on its composite tree and on bounding volumes, by geometric means over all scenes."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd

from palpate.number_text import percent_in_table as percent
from palpate.report.claims import Claim, claims, geometric_mean, not_testable, verdict

TIED = 0.05  # relative difference below which two times count as equal: repeated runs differ by as much
NEAR_IN_FALSE_PAIRS = 0.25  # relative excess of false pairs over the AABB tree that still counts as near it
FEW = 0.01  # share of all pairs of triangles up to which a broad phase leaves few


@claims("collision")
def composite_trees(tables: Mapping[str, pd.DataFrame]) -> Iterator[Claim]:
    """Yield the claims on composite trees: two for each of them, after those on all trees."""
    trees = means(tables["collision"])
    premise = f"mean of {tables['collision']['scene'].nunique()} scenes, one core"
    builds, tested = trees.xs("", level="depths")["build_ms"], trees.loc[("aabb", ""), "tested"]
    ours = ", ".join(f"{name} {time:.3g} ms" for name, time in builds.items())
    judged = verdict(builds["aabb"] <= (1 + TIED) * builds.min())
    yield Claim(3, "4", "AABBs are cheap to build", premise, "preferred for bodies that deform", ours, judged)
    ours = f"at most {percent(tested)} of all pairs of triangles reach the narrow phase, with AABBs"
    claim = "bounding volumes discard far pairs before the narrow phase"
    yield Claim(3, "4", claim, premise, "they do", ours, verdict(tested < FEW))
    for depths in trees.loc["composite"].index:
        sphere, tree, box = (trees.loc[key] for key in (("sphere", ""), ("composite", depths), ("aabb", "")))
        yield from _composite(sphere, tree, box, f"{depths} layers; {premise}")
    claim = "triangles are tested by projection to a lower dimension, an improved version of a published test"
    why = "it does not say what is improved, or by how much"
    yield Claim(3, "4", claim, "the preserved text", "improved", "exact predicates instead", not_testable(why))


def means(collision: pd.DataFrame) -> pd.DataFrame:
    """Return times, false pairs and the largest tested part of all pairs of each tree of palpate.

    Rows are by structure and depths. False pairs reach the triangle test and do not cross; 1 is added so that geometric
    means exist. A query has both phases, as the paper compares them.
    """
    own_rows = collision[~collision["rival"].astype(bool)].fillna({"depths": ""})
    own_rows = own_rows.assign(false_pairs=1 + own_rows["triangle_tests"] - own_rows["pairs"])
    trees = own_rows.groupby(["structure", "depths"], sort=False)
    shares = own_rows["triangle_tests"] / (0.5 * own_rows["triangles"]) ** 2
    largest_share = shares.groupby([own_rows["structure"], own_rows["depths"]], sort=False).max()
    return trees[["build_ms", "refit_ms", "query_ms", "false_pairs"]].agg(geometric_mean).assign(tested=largest_share)


def _composite(sphere: pd.Series, composite: pd.Series, box: pd.Series, premise: str) -> Iterator[Claim]:
    """Judge a composite tree's query time and false pairs by those of sphere and AABB trees."""
    trees = {"sphere": sphere, "composite": composite, "AABB": box}
    few_false_pairs = composite["false_pairs"] <= (1 + NEAR_IN_FALSE_PAIRS) * box["false_pairs"]
    times = ", ".join(f"{name} {tree['query_ms']:.3g} ms" for name, tree in trees.items())
    false_pairs = ", ".join(f"{name} {tree['false_pairs']:,.0f}" for name, tree in trees.items())
    time, precision = "the composite tree's query takes a time", "the composite tree's false pairs are"
    yield Claim(3, "4", time, premise, "between sphere and AABB trees", times, _between(sphere, composite, box))
    yield Claim(3, "4", precision, premise, "near those of AABB trees", false_pairs, verdict(few_false_pairs))


def _between(sphere: pd.Series, composite: pd.Series, box: pd.Series) -> str:
    """Return the verdict on whether the composite tree's query time is between the others; not testable if tied."""
    time, *others = (tree["query_ms"] for tree in (composite, sphere, box))
    if any(max(time, other) <= (1 + TIED) * min(time, other) for other in others):
        return not_testable(f"it equals one of them within {percent(TIED)}, as times repeat")
    return verdict(min(others) < time < max(others))


PURE = ("sphere", "aabb", "obb", "dop14", "dop18")
RANKED = 0.7  # rank correlation from which on times rise, or errors fall, with the layer
EDGE = 0.005  # distance [m] that counts as precise: about the edge of a triangle of the shipped livers
TURNED = 30.0  # angle [°] up to which a direction counts as precise
SMALL_DEPTH_ERROR = 0.25  # share of a depth up to which its error counts as small


@claims("collision", "collision_precision", "collision_apart")
def bounding_volumes(tables: Mapping[str, pd.DataFrame]) -> Iterator[Claim]:
    """Yield the claims on bounding volumes, by geometric means over scenes, or over gaps and pairs of bodies."""
    stopped, apart = (_own(tables[name]) for name in ("collision_precision", "collision_apart"))
    yield from _volumes(tables["collision"], apart)
    yield _discarded(apart)
    yield _traded(stopped)
    yield from _carried(stopped)


def _own(table: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of palpate's own trees, with depths as text."""
    is_rival = table["rival"].astype(bool) if "rival" in table else np.zeros(len(table), dtype=bool)
    return table[~is_rival].assign(depths=lambda rows: rows["depths"].fillna("").astype(str))


def _volumes(collision: pd.DataFrame, apart: pd.DataFrame) -> Iterator[Claim]:
    """Judge the costs of a test, a refit and a build of each kind of volume, and how tight it is."""
    premise = f"{collision['scene'].nunique()} deforming scenes, geometric means"
    trees = _in_order(means(collision).xs("", level="depths"))
    builds, refits, false = trees["build_ms"], trees["refit_ms"], trees["false_pairs"]
    tests = _in_order(apart[apart["structure"].isin(PURE)].groupby("structure")["test_ns"].agg(geometric_mean))
    judged = [
        ("a sphere is the cheapest volume to test", "a loop of the tests of queries of bodies that are apart",
         "cheapest", _listed(tests, "ns a test"), tests["sphere"] <= (1 + TIED) * tests.min()),
        ("an AABB is cheap to update, so preferred for bodies that deform", premise, "cheap",
         _listed(refits, "ms a refit"), refits["aabb"] <= (1 + TIED) * refits.min()),
        ("an OBB is costly to rebuild", premise, "costly", _listed(builds, "ms a build"), builds.idxmax() == "obb"),
        ("a sphere is loose, an OBB tight", premise, "loose, tight", _listed(false, "false pairs"),
         false.idxmax() == "sphere" and false["obb"] < false["aabb"]),
        ("trees of bodies that deform are refitted, not rebuilt", premise, "refit",
         f"a refit takes {refits['aabb'] / builds['aabb']:.2g} of a build (AABB)", refits["aabb"] < builds["aabb"]),
    ]  # fmt: skip
    for claim, tested_in, published, ours, holds in judged:
        yield Claim(3, "4", claim, tested_in, published, ours, verdict(holds))


def _discarded(apart: pd.DataFrame) -> Claim:
    """Judge whether the best composite tree shows faster than an AABB tree that rigid bodies are apart."""
    trees = apart[apart["structure"].isin(["sphere", "aabb", "composite"])]
    times = trees.groupby(["structure", "depths"], sort=False)
    query, frame = (times[column].agg(geometric_mean) for column in ("query_ms", "frame_ms"))
    best = query["composite"].idxmin()
    ours = (
        f"query: AABB {query['aabb', '']:.3g} ms, sphere {query['sphere', '']:.3g} ms, composite {best} "
        f"{query['composite', best]:.3g} ms; with refit {frame['aabb', '']:.3g}, {frame['sphere', '']:.3g}, "
        f"{frame['composite', best]:.3g} ms"
    )
    gaps = 1e3 * apart["gap_m"]
    return Claim(
        3, "4", "upper layers of spheres discard distant bodies fast: less time than AABBs take",
        f"rigid bodies {gaps.min():g} to {gaps.max():g} mm apart, the best of {query['composite'].size} composites",
        "faster than AABBs", ours, verdict(query["composite", best] < (1 - TIED) * query["aabb", ""]),
    )  # fmt: skip


def _traded(stopped: pd.DataFrame) -> Claim:
    """Judge whether stopping a composite tree at a deeper layer takes longer and gives a more precise response."""
    from scipy.stats import spearmanr  # it takes most of a second

    trees = stopped[(stopped["structure"] == "composite") & ~stopped["exact"].astype(bool)]
    by_layer = trees.groupby("layer")[["frame_ms", "response_error_m"]].agg(geometric_mean)
    times, errors = by_layer["frame_ms"], by_layer["response_error_m"]
    ours = "; ".join(
        f"layer {layer:g}: {row.frame_ms:.2g} ms, {1e3 * row.response_error_m:.2g} mm"
        for layer, row in by_layer.iterrows()
    )
    correlations = [spearmanr(by_layer.index, values)[0] for values in (times, errors)]
    touching = trees[trees["response_m"] > 0.0]
    worse = touching["response_error_m"] >= touching["response_m"]
    deepest = touching["layer"] == touching["layer"].max()
    holds = correlations[0] > RANKED and correlations[1] < -RANKED and not worse[deepest].any()
    ours += f"; in {worse.sum()} of {len(touching)} settings with contact the error is no less than that of no contact"
    return Claim(
        3, "4", "the depths of the layers trade speed for accuracy",
        f"composite trees stopped at a layer, {stopped['scene'].nunique()} scenes: frame, error of the response; the "
        "deepest layer has to be better than to report no contact", "a trade", ours, verdict(bool(holds)),
    )  # fmt: skip


def _carried(stopped: pd.DataFrame) -> Iterator[Claim]:
    """Judge place, direction and depth of triangles' contacts, in scenes where bodies overlap by little if any do."""
    exact = stopped[stopped["exact"].astype(bool) & stopped["place_error_m"].notna() & (stopped["structure"] == "aabb")]
    shallow = exact[exact["response_m"] < 2 * EDGE]
    chosen = shallow if len(shallow) else exact
    place, turn = 1e3 * chosen["place_error_m"].mean(), chosen["direction_error_deg"].mean()
    depth, size = 1e3 * chosen["depth_error_m"].mean(), 1e3 * chosen["response_m"].mean()
    premise = f"{len(chosen)} scenes of overlaps of {size:.2g} mm (RMS), against VTK's signed distances"
    yield Claim(
        3, "4", "tests of triangles give place and direction of a contact", f"{premise}; edges of {1e3 * EDGE:g} mm",
        "place, direction", f"{place:.2g} mm and {turn:.2g}° in error", verdict(place < 1e3 * EDGE and turn < TURNED),
    )  # fmt: skip
    small_error = depth < SMALL_DEPTH_ERROR * size
    yield Claim(
        3, "4", "tests of triangles give the depth of a contact", f"{premise}; a pair knows no depth beyond its size",
        "depth", f"{depth:.2g} mm in error", verdict(small_error, len(shallow) > 0),
    )  # fmt: skip


def _in_order(by_structure: Any) -> Any:
    """Return a table or series by structure in the order of PURE."""
    return by_structure.reindex([name for name in PURE if name in by_structure.index])


def _listed(values: pd.Series, unit: str) -> str:
    names = {"sphere": "sphere", "aabb": "AABB", "obb": "OBB", "dop14": "14-DOP", "dop18": "18-DOP"}
    return f"{unit}: " + ", ".join(f"{names[name]} {value:.3g}" for name, value in values.items())
