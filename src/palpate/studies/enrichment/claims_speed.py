"""Judge how much faster than fine FEM paper 1 claims its enrichment to be."""

from collections.abc import Iterator, Mapping

import pandas as pd

from palpate.report.claims import Claim, verdict

TABLES = ("enrichment_timing",)
QUERY = "query alone, with the coarse response given, as the paper times it"
WHOLE = "query and the simulation of the coarse mesh, which a program needs"


def claims(tables: Mapping[str, pd.DataFrame]) -> Iterator[Claim]:
    """Yield for each body that the paper times the speed-up of a query, and with the coarse simulation."""
    timing = tables["enrichment_timing"].set_index(["body", "method"])
    for body in timing.index.unique("body"):
        times = timing.loc[body]
        ours, theirs = times["mean_s"], times["paper_mean_s"]
        published = theirs["fine_fem"] / theirs["contact_ordered"]
        if not published > 0.0:
            continue
        coarse_s = max(ours["live_all_in"] - ours["detail_correction"], 0.0)
        for premise, seconds in ((QUERY, ours["contact_ordered"]), (WHOLE, ours["contact_ordered"] + coarse_s)):
            ratio = ours["fine_fem"] / seconds
            yield Claim(
                1,
                "4, tables 4 and 5",
                f"enrichment is hundreds of times as fast as fine FEM ({body})",
                premise,
                f"{published:.0f} times",
                f"{ratio:.0f} times",
                verdict(bool(ratio >= published)),
            )
