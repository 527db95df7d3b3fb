"""Judge paper 3's claims on its composite tree, over all scenes (geometric means)."""

from collections.abc import Iterator, Mapping

import pandas as pd

from palpate.report.claims import Claim, geometric_mean, not_testable, percent, verdict

TABLES = ("collision",)

TIED = 0.05
"""Relative difference below which two times count as equal: repeated runs differ by as much."""
NEAR = 0.25
"""Relative excess of false pairs over the AABB tree that still counts as near it."""
FEW = 0.01
"""Share of all pairs of triangles up to which a broad phase leaves few."""


def claims(tables: Mapping[str, pd.DataFrame]) -> Iterator[Claim]:
    """Yield the claims: two for each composite tree, after those on all."""
    trees = means(tables["collision"])
    premise = f"mean of {tables['collision']['scene'].nunique()} scenes, one core"
    yield _built(trees, premise)
    yield _broad(trees.loc["aabb", ""], premise)
    for depths in trees.loc["composite"].index:
        sphere, tree, box = (trees.loc[key] for key in (("sphere", ""), ("composite", depths), ("aabb", "")))
        yield from _composite(sphere, tree, box, f"{depths} layers; {premise}")
    yield Claim(
        3,
        "4",
        "triangles are tested by projection to a lower dimension, an improved version of a published test",
        "the preserved text",
        "improved",
        "exact predicates instead",
        not_testable("it does not say what is improved, or by how much"),
    )


def means(collision: pd.DataFrame) -> pd.DataFrame:
    """Return times and false pairs of each own tree, by structure and depths, and its largest share of tested pairs.

    False pairs are those that reach the triangle test but do not cross, counted from 1, so that geometric means exist.
    The time of a query is that of both phases, which is the part that the paper compares.
    """
    tested = collision[~collision["rival"].astype(bool)].fillna({"depths": ""})
    tested = tested.assign(false_pairs=1 + tested["triangle_tests"] - tested["pairs"])
    trees = tested.groupby(["structure", "depths"], sort=False)
    shares = tested["triangle_tests"] / (0.5 * tested["triangles"]) ** 2
    largest = shares.groupby([tested["structure"], tested["depths"]], sort=False).max()
    return trees[["build_ms", "query_ms", "false_pairs"]].agg(geometric_mean).assign(tested=largest)


def _built(trees: pd.DataFrame, premise: str) -> Claim:
    """Judge whether a tree of AABBs is as cheap to build as any."""
    times = trees.xs("", level="depths")["build_ms"]
    ours = ", ".join(f"{name} {time:.3g} ms" for name, time in times.items())
    holds = times["aabb"] <= (1 + TIED) * times.min()
    return Claim(3, "4", "AABBs are cheap to build", premise, "preferred for bodies that deform", ours, verdict(holds))


def _broad(box: pd.Series, premise: str) -> Claim:
    """Judge what a broad phase leaves to the narrow one."""
    ours = f"at most {percent(box['tested'])} of all pairs of triangles reach the narrow phase, with AABBs"
    claim = "bounding volumes discard far pairs before the narrow phase"
    return Claim(3, "4", claim, premise, "they do", ours, verdict(box["tested"] < FEW))


def _composite(sphere: pd.Series, composite: pd.Series, box: pd.Series, premise: str) -> Iterator[Claim]:
    """Judge both claims for one composite tree."""
    trees = {"sphere": sphere, "composite": composite, "AABB": box}
    near = composite["false_pairs"] <= (1 + NEAR) * box["false_pairs"]
    times = ", ".join(f"{name} {tree['query_ms']:.3g} ms" for name, tree in trees.items())
    false_pairs = ", ".join(f"{name} {tree['false_pairs']:,.0f}" for name, tree in trees.items())
    time, precision = "the composite tree's query takes a time", "the composite tree's false pairs are"
    yield Claim(3, "4", time, premise, "between sphere and AABB trees", times, _between(sphere, composite, box))
    yield Claim(3, "4", precision, premise, "near those of AABB trees", false_pairs, verdict(near))


def _between(sphere: pd.Series, composite: pd.Series, box: pd.Series) -> str:
    """Judge a query time against those at both ends; it is tied if it equals one as far as times repeat."""
    time, *ends = (tree["query_ms"] for tree in (composite, sphere, box))
    if any(max(time, end) <= (1 + TIED) * min(time, end) for end in ends):
        return not_testable(f"it equals one of them within {percent(TIED)}, as times repeat")
    return verdict(min(ends) < time < max(ends))
