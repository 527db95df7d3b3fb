"""Judge what paper 1 names as the limit of its method, and its kernel in place of a linear regressor."""

from collections.abc import Iterator, Mapping

import pandas as pd

from palpate.report.claims import Claim, geometric_mean, percent, verdict

TABLES = ("premises", "premise_bodies")
KERNEL, LINEAR = "nonnegative_a", "linear"
RISES = 0.8
"""Rank correlation from which on errors rise with the share of the surface that moves."""


def claims(tables: Mapping[str, pd.DataFrame]) -> Iterator[Claim]:
    """Yield the claims, with all samples and contacts held out."""
    rows = tables["premises"]
    rows = rows[(rows["held_out"] == "contacts") & rows["features"].isin(["ordered", "unordered"])]
    rows = rows[rows["train"] == rows.groupby("premise")["train"].transform("max")]
    errors = rows.pivot_table(index="premise", columns=["features", "weights"], values="rmse_of_peak")
    moved = tables["premise_bodies"].set_index("premise")["moved_share"].reindex(errors.index)
    yield _limit(errors["ordered", KERNEL], moved)
    for features in ("ordered", "unordered"):
        yield _kernel(errors[features], features)


def _limit(error: pd.Series, moved: pd.Series) -> Claim:
    """Compare errors with how much of the surface moves by more than a tenth of the peak."""
    rank, least, most = error.corr(moved, method="spearman"), moved.idxmin(), moved.idxmax()
    places = (
        f"{percent(error[name])} of the peak where {percent(moved[name])} of the surface moves"
        for name in (least, most)
    )
    ours = f"{', '.join(places)}; rank correlation {rank:.2f}"
    claim = "global deformation is the limit of contact-ordered features"
    return Claim(
        1, "5", claim, f"{len(error)} premises, contacts held out", "named as future work", ours, verdict(rank > RISES)
    )


def _kernel(errors: pd.DataFrame, features: str) -> Claim:
    """Compare the Gaussian kernel with the linear regressor, in the geometric mean."""
    ratio = errors[KERNEL] / errors[LINEAR]
    mean = geometric_mean(ratio)
    ours = f"{mean:.2g} times its error in the geometric mean, smaller in {(ratio < 1).sum()} of {len(ratio)} premises"
    claim = "a Gaussian kernel does better than the linear regressor"
    premise = f"{len(ratio)} premises, {features} features, contacts held out"
    return Claim(1, "3.2", claim, premise, "used in its place", ours, verdict(mean < 1.0))
