"""Judge what paper 1 claims about contact-ordered features: in each premise, with fewer samples, in memory."""

from collections.abc import Iterator, Mapping
from typing import Any

import pandas as pd

from palpate.report.claims import CONFIRMED, REFUTED, Claim, verdict
from palpate.studies.enrichment.premises import LOCAL

TABLES = ("premises", "premise_bodies", "database_memory")
PAPERS = "nonnegative_a"
CLEARLY = 0.8
"""An error is clearly below another if their ratio is under this, and its whole interval under 1; it is on a par if the
interval begins at the reciprocal or below."""
BETTER, ALIKE = "clearly better", "on a par"
CLAIMED = {"cylinder": BETTER, "liver": ALIKE}
"""What the paper claims of its bodies; of others, as of the cylinder, that features ordered by contact are better."""


def claims(tables: Mapping[str, pd.DataFrame]) -> Iterator[Claim]:
    """Yield a claim about errors and one about samples for each premise, and two about memory for each body.

    Errors are judged with samples held out, as the paper does; with contacts held out they are given, too.
    """
    shown = tables["premises"]
    shown = shown[shown["weights"] == PAPERS].set_index(["premise", "held_out", "train", "features"]).sort_index()
    for about in tables["premise_bodies"].itertuples():
        yield _errors(about, shown.loc[about.premise])
        yield _fewer(about, shown.loc[(about.premise, "contacts")])
    yield from _memory(tables["database_memory"])


def _premise(about: Any) -> str:
    made = "" if about.made_of == "solid" else f", a surface of {about.made_of}"
    held = f"held {about.held}" + (" is" if about.held.startswith("as") else "")
    return (
        f"{about.premise.replace('_', ' ')}: {about.body}{made}, {held}, {about.responses}; "
        f"{100 * about.moved_share:.0f} % of the surface moves"
    )


def _verdict(holds: bool, about: Any) -> str:
    return verdict(holds, within=about.moved_share <= LOCAL)


def _errors(about: Any, rows: pd.DataFrame) -> Claim:
    """Judge ordered against unordered features, by the ratio of their errors and its interval."""
    claimed = CLAIMED.get(about.body, BETTER)
    most = rows.index.get_level_values("train").max()
    paper, strict = (rows.loc[(kind, most, "ordered")] for kind in ("samples", "contacts"))
    holds = paper["ratio"] < CLEARLY and paper["ratio_high"] < 1.0
    if claimed == ALIKE:
        holds = paper["ratio_low"] <= 1.0 / CLEARLY
    return Claim(
        1,
        "4, figure 4",
        f"contact-ordered features: error {claimed} compared with unordered ones",
        _premise(about),
        claimed,
        f"{_ratio(paper)} times the error with samples held out, {_ratio(strict)} with contacts held out",
        _verdict(bool(holds), about),
    )


def _ratio(row: pd.Series) -> str:
    return f"{row['ratio']:.2f} [{row['ratio_low']:.2f}, {row['ratio_high']:.2f}]"


def _fewer(about: Any, rows: pd.DataFrame) -> Claim:
    """Judge whether ordered features with the fewest samples do as well as unordered ones with all."""
    train = rows.index.get_level_values("train")
    few, many = rows.loc[(train.min(), "ordered")], rows.loc[(train.max(), "unordered")]
    return Claim(
        1,
        "3.1",
        "contact-ordered features need fewer samples, as one serves many contacts",
        _premise(about),
        "fewer",
        f"{100 * few['rmse_of_peak']:.3g} % with {train.min()} samples, unordered {100 * many['rmse_of_peak']:.3g} % "
        f"with {train.max()}; contacts held out",
        _verdict(bool(few["rmse_of_peak"] <= many["rmse_of_peak"]), about),
    )


def _memory(memory: pd.DataFrame) -> Iterator[Claim]:
    """Judge the memory of feature vectors, and of all that a query may need."""
    for premise, rows in memory.groupby("premise", sort=False):
        if premise not in CLAIMED:
            continue
        sizes = rows.set_index("features")
        for column, what in (("features_kb", "feature vectors"), ("total_kb", "all that a query may need")):
            ordered, unordered = sizes.loc["ordered", column], sizes.loc["unordered", column]
            yield Claim(
                1,
                "3.1",
                "contact-ordered features need less memory",
                f"{premise}: {what}",
                "less",
                f"{ordered:,.0f} kB against {unordered:,.0f} kB",
                CONFIRMED if ordered < unordered else REFUTED,
            )
