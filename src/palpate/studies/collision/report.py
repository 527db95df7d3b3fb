"""Report on paper 3, chapter 4: bounding structures compared, and how they grow."""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from palpate.report import tables
from palpate.report.closing import claims_of as found
from palpate.report.closing import counted
from palpate.report.closing import joined as said
from palpate.report.material import Report, Section
from palpate.report.number_format import seconds
from palpate.report.words import spaced
from palpate.studies.collision.collision_growth import STAGES, exponents
from palpate.studies.collision.figures.collision_looks import look, ranked
from palpate.studies.collision.report_numbers import precision_numbers
from palpate.studies.collision.tables import TABLES

__all__ = ["TABLES", "TITLE", "failures", "numbers", "sections"]

TITLE = "Paper 3: collision"


def numbers(report: Report) -> dict[str, str]:
    """Return every placeholder of these captions, as text."""
    collision, scaling = (report.tables[f"collision{end}"] for end in ("", "_scaling"))
    collision, scaling = ranked(collision), ranked(scaling)
    stopped, apart = (report.tables[f"collision_{name}"] for name in ("precision", "apart"))
    own = collision[~collision["rival"].astype(bool)]
    return {
        "headline": _headline(collision),
        "source": report.published["collision"]["source"],
        "collision_missed": _missed(own),
        "collision_rivals": _rivals(collision),
        "collision_fastest": "; ".join(
            f"{spaced(s)}: {_fastest(tables.where(own, scene=s))}" for s in tables.scenes(own)
        ),
        "collision_wrong": _wrong(collision[collision["rival"].astype(bool)]),
        "collision_exponents": _exponents(scaling),
        "collision_verdicts": _verdicts(found(report, "collision")),
        "collision_plain": _plain(own),
        **precision_numbers(ranked(stopped), ranked(apart)),
    }


def _missed(own: pd.DataFrame) -> str:
    """Return how many pairs our structures missed or reported wrongly, in how many frames."""
    wrong = int(own["missed_pairs"].sum() + own["extra_pairs"].sum())
    return f"{wrong} pairs missed or reported wrongly in {int(own['frames'].sum()):,} frames"


def _fastest(own: pd.DataFrame) -> str:
    """Return the structure of the shortest frame."""
    best = own.loc[own["frame_ms"].idxmin()]
    return f"{_label(best)}, {seconds(1e-3 * best['frame_ms'])}"


def _rivals(collision: pd.DataFrame) -> str:
    """Return how many times the fastest structure's frame each rival's takes, in each scene that it can do."""
    phrases = []
    for structure, rows in collision[collision["rival"].astype(bool)].groupby("structure", sort=False):
        ratios = []
        for row in rows.itertuples():
            least = tables.where(collision, scene=row.scene, rival=False)["frame_ms"].min()
            ratios.append(f"{spaced(row.scene)} {row.frame_ms / least:.1f}")
        phrases.append(f"{look(structure).label}: {', '.join(ratios)}")
    return "; ".join(phrases) or "none is installed"


def _wrong(rivals: pd.DataFrame) -> str:
    """Return how many pairs the rivals missed or reported wrongly."""
    sums = rivals.groupby("structure", sort=False)[["missed_pairs", "extra_pairs"]].sum()
    return "; ".join(
        f"{look(row.Index).label} {int(row.missed_pairs):,} missed and {int(row.extra_pairs):,} reported wrongly"
        for row in sums.itertuples()
    )


def _exponents(scaling: pd.DataFrame) -> str:
    """Return the range of each stage's exponents over our structures."""
    fits = exponents(scaling[~scaling["rival"].astype(bool)])
    ranges = ((stage.removesuffix("_ms"), fits[stage].min(), fits[stage].max()) for stage in STAGES)
    return ", ".join(f"{stage} n^{low:.2f} to n^{high:.2f}" for stage, low, high in ranges)


def _verdicts(judged: pd.DataFrame) -> str:
    """Return how many tests of each claim on composite trees hold."""
    kinds = {"query": "query time", "false pairs": "false pairs"}
    rows = {
        word: judged[judged["claim"].str.startswith(f"the composite tree's {kind}")] for kind, word in kinds.items()
    }
    return (
        "; ".join(f"{word} {said(counted(tests['verdict']))}" for word, tests in rows.items() if len(tests))
        or "none judged"
    )


def _plain(own: pd.DataFrame) -> str:
    """Compare the fastest composite tree's frames with AABB trees', over all scenes (geometric mean)."""
    logs = np.log(own["frame_ms"]).groupby([own["structure"], own["depths"]]).mean()
    best = logs.loc["composite"].idxmin()
    return (
        f"{look('composite', best).label} takes {np.exp(logs['composite', best] - logs['aabb', '']):.2f} times as long"
    )


def _label(row: pd.Series) -> str:
    return look(row["structure"], row["depths"]).label


def _headline(collision: pd.DataFrame) -> str:
    """Compare the frame of two livers, of our structures and of the rivals'."""
    rows = tables.where(collision, scene="two_livers")
    best = tables.where(rows, rival=False)
    best = best.loc[best["frame_ms"].idxmin()]
    sentence = (
        f"Two livers of together {int(best['triangles']):,} triangles deform and meet. A frame, in which the tree is "
        f"refitted and all crossing pairs are found exactly, takes {seconds(1e-3 * best['frame_ms'])} on one core with "
        f"{_label(best)}"
    )
    others = [
        f"{look(row.structure).label}: {seconds(1e-3 * row.frame_ms)}"
        for row in rows[rows["rival"].astype(bool)].itertuples()
    ]
    return sentence + (f" ({'; '.join(others)})." if others else ".")


def failures(report: Report) -> Iterator[tuple[str, str, str]]:
    """Yield the structures that missed crossing pairs or reported wrong ones: what, where, how."""
    table = report.tables["collision"]
    for row in ranked(table[table["missed_pairs"] + table["extra_pairs"] > 0]).itertuples():
        how = f"{int(row.missed_pairs):,} crossing pairs missed, {int(row.extra_pairs):,} reported wrongly"
        yield look(row.structure, row.depths).label, spaced(row.scene), how


def sections(report: Report) -> list[Section]:
    """Return a figure and its table each."""
    compared = report.figure("collision") + report.folded("collision")
    stopped = report.figure("collision_precision") + report.folded("collision_precision")
    apart = report.figure("collision_apart") + report.folded("collision_apart")
    grown = report.figure("collision_scaling") + report.folded("collision_scaling")
    return [
        ("collision_section", "Bounding structures", compared),
        ("collision_precision_section", "Precision for time", stopped),
        ("collision_apart_section", "Bodies that are apart", apart),
        ("collision_scaling_section", "Up to a million triangles", grown),
    ]
