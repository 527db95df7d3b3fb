"""Judge why paper 2 takes springs: finite elements, it says, are greatly limited where the topology changes."""

from collections.abc import Callable, Iterator, Mapping

import pandas as pd

from palpate.bodies.cutting.ways import SPLIT_FACES, VIRTUAL_NODES
from palpate.number_text import percent_in_table as percent
from palpate.report.claims import Claim, claims, verdict

LIMITED = 10.0
"""Finite elements are greatly limited if they take so many times as long as springs, err so much more, or fail."""
BESIDE = ("surface_error", "opening_error", "force_error", "change_median_s", "first_median_s")
"""What is told of springs beside elements."""


def compared(cut: pd.DataFrame) -> pd.DataFrame:
    """Return a row for each scene, level and way of which elements and springs were asked, springs at their best.

    Columns are those of CUT for elements, those BESIDE of springs after ``springs_``; slower : the time of the first
    answer over that of springs
    """
    keys, of_both_ways = ["scene", "level", "way"], cut[cut["way"].isin([SPLIT_FACES, VIRTUAL_NODES])]
    springs = of_both_ways[of_both_ways["model"] == "springs"].dropna(subset="surface_error")
    springs = springs.sort_values("surface_error", kind="stable").drop_duplicates(keys)
    names = {name: f"springs_{name}" for name in BESIDE}
    pairs = of_both_ways[of_both_ways["model"] == "fem"].merge(springs[[*keys, *BESIDE]].rename(columns=names), on=keys)
    return pairs.assign(slower=pairs["first_median_s"] / pairs["springs_first_median_s"])


@claims("cut")
def limited(tables: Mapping[str, pd.DataFrame]) -> Iterator[Claim]:
    """Yield whether elements are greatly limited by cuts, beside springs on the same level that is cut the same way."""
    pairs = compared(tables["cut"])
    if pairs.empty:
        return
    largest_factor = max((pairs[name] / pairs[f"springs_{name}"]).max() for name in ("surface_error", "opening_error"))
    count = pairs["scene"].nunique()
    premise = f"{count} cut{'s' if count > 1 else ''}, lips pulled apart; {len(pairs)} pairs of the same level and way"
    times = f"first answers after the blade's move take {_range(pairs['slower'], '{:.2g}'.format)} times as long"
    surface, opening = (
        f"{_range(pairs[name], percent)}, springs' {_range(pairs[f'springs_{name}'], percent)}"
        for name in ("surface_error", "opening_error")
    )
    failed = int(pairs["surface_error"].isna().sum())
    results = f"{times}; errors over the surface are {surface}, of the opening {opening}"
    results += f"; {failed} have no answer" if failed else ""
    claim = "finite elements are greatly limited where the topology changes, and springs are not"
    holds = failed > 0 or max(pairs["slower"].max(), largest_factor) >= LIMITED
    yield Claim(2, "why springs", claim, premise, "greatly limited", results, verdict(bool(holds)))


def _range(values: pd.Series, words: Callable[[float], str]) -> str:
    return f"{words(values.min())} to {words(values.max())}"
