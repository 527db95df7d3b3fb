"""Judge what paper 3, chapter 3, says of shape matching by the hard cases that test it."""

from collections.abc import Iterator, Mapping

import pandas as pd

from palpate.report.claims import Claim, claims, verdict

JUDGED = {
    "goals_step": ("goal positions are stable for any step, in a body", "for any h"),
    "flat_rest": (
        "clusters that are degenerate, a point, a line or a plane, stay stable",
        "not said; by diagonalising AᵀA",
    ),
}
"""Claims and what is published of them, by the beginning of the names of cases."""


@claims("hard_cases")
def shape_matching(tables: Mapping[str, pd.DataFrame]) -> Iterator[Claim]:
    """Yield a claim for each kind of case that the table has."""
    table = tables["hard_cases"]
    for prefix, (claim, published) in JUDGED.items():
        rows = table[table["case"].str.startswith(prefix)]
        if len(rows):
            stable = int((rows["outcome"] == "stable").sum())
            worst_words = f"{rows['value'].max():.1g} off at most (bound {rows['bound'].max():.1g})"
            ours, premise = f"{stable} of {len(rows)} runs, {worst_words}", "; ".join(dict.fromkeys(rows["scene"]))
            yield Claim(3, "3", claim, premise, published, ours, verdict(stable == len(rows)))
