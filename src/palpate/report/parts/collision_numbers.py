"""The numbers that the captions and the headline about collision name, worked out from its tables."""

import numpy as np
import pandas as pd

from palpate.evaluation.collision.collision_growth import STAGES, exponents
from palpate.figures import tables
from palpate.figures.collision.collision_looks import look, ranked
from palpate.figures.number_format import each, seconds


def numbers(all_tables: dict[str, pd.DataFrame], published: dict) -> dict[str, str]:
    """Every placeholder of these captions, as text.

    published : workflow/report/soft_bodies.yaml, the paper's own numbers
    """
    collision, scaling, claims = (all_tables[f"collision{end}"] for end in ("", "_scaling", "_claims"))
    collision, scaling = ranked(collision), ranked(scaling)
    ours = collision[~collision["rival"].astype(bool)]
    return {
        "source_collision": published["source"],
        "headline_collision": _headline(collision),
        "collision_missed": _missed(ours),
        "collision_rivals": _rivals(collision),
        "collision_fastest": each(tables.scenes(ours), lambda scene: _fastest(tables.where(ours, scene=scene))),
        "collision_wrong": _wrong(collision[collision["rival"].astype(bool)]),
        "collision_exponents": _exponents(scaling),
        "collision_verdicts": _verdicts(claims),
        "collision_plain": _plain(ours),
    }


def _missed(ours) -> str:
    """How many pairs our structures missed or made up, in how many frames of how many scenes."""
    wrong = int(ours["missed_pairs"].sum() + ours["extra_pairs"].sum())
    return f"{wrong} pairs missed or made up in {int(ours['frames'].sum()):,} frames"


def _fastest(ours) -> str:
    """The structure of the shortest frame."""
    best = ours.loc[ours["frame_ms"].idxmin()]
    return f"{_label(best)}, {seconds(1e-3 * best['frame_ms'])}"


def _rivals(collision) -> str:
    """How many times the fastest structure's frame each rival's takes, in each scene that it can do."""
    phrases = []
    for structure, rows in collision[collision["rival"].astype(bool)].groupby("structure", sort=False):
        ratios = []
        for row in rows.itertuples():
            ours = tables.where(collision, scene=row.scene, rival=False)["frame_ms"].min()
            ratios.append(f"{row.scene.replace('_', ' ')} {row.frame_ms / ours:.1f}")
        phrases.append(f"{look(structure).label}: {', '.join(ratios)}")
    return "; ".join(phrases) or "none is installed"


def _wrong(rivals) -> str:
    """What the rivals got wrong."""
    sums = rivals.groupby("structure", sort=False)[["missed_pairs", "extra_pairs"]].sum()
    return "; ".join(
        f"{look(row.Index).label} {int(row.missed_pairs):,} missed and {int(row.extra_pairs):,} made up"
        for row in sums.itertuples()
    )


def _exponents(scaling) -> str:
    """The range of each stage's exponents over our structures."""
    fits = exponents(scaling[~scaling["rival"].astype(bool)])
    ranges = ((stage.removesuffix("_ms"), fits[stage].min(), fits[stage].max()) for stage in STAGES)
    return ", ".join(f"{stage} n^{low:.2f} to n^{high:.2f}" for stage, low, high in ranges)


def _verdicts(claims) -> str:
    """How many comparisons of each claim hold."""
    kinds = claims["claim"].str.split(" (", regex=False).str[0]
    counts = (claims["verdict"] == "confirmed").groupby(kinds, sort=False).agg(["sum", "size"])
    return ", ".join(f"{kind} confirmed in {row['sum']} of {row['size']} rows" for kind, row in counts.iterrows())


def _plain(ours) -> str:
    """What the fastest composite tree takes, in AABB trees' frames, over all scenes (geometric mean)."""
    logs = np.log(ours["frame_ms"]).groupby([ours["structure"], ours["depths"]]).mean()
    best = logs.loc["composite"].idxmin()
    return (
        f"{look('composite', best).label} takes {np.exp(logs['composite', best] - logs['aabb', '']):.2f} times as long"
    )


def _label(row) -> str:
    return look(row["structure"], row["depths"]).label


def _headline(collision) -> str:
    """The frame of two livers, ours and the rivals'."""
    rows = tables.where(collision, scene="two_livers")
    best = tables.where(rows, rival=False)
    best = best.loc[best["frame_ms"].idxmin()]
    said = (
        f"Two livers of together {int(best['triangles']):,} triangles deform and meet: a frame of refitting and of "
        f"finding all crossing pairs exactly takes {seconds(1e-3 * best['frame_ms'])} on one core with {_label(best)}"
    )
    others = [
        f"{look(row.structure).label}: {seconds(1e-3 * row.frame_ms)}"
        for row in rows[rows["rival"].astype(bool)].itertuples()
    ]
    return said + (f" ({'; '.join(others)})." if others else ".")
