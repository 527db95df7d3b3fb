"""Compute what the report says of collision beside its tables: ratios of times, growth and verdicts."""

from typing import Any

import pandas as pd

from palpate.report import tables
from palpate.report.claims import geometric_mean
from palpate.report.closing import claims_of, counted, joined
from palpate.report.report import Report
from palpate.report.words import spaced
from palpate.studies.collision.compare_trees import STAGES, exponents
from palpate.studies.collision.figures import look, ranked


def numbers(report: Report) -> dict[str, Any]:
    """Return what the template names beside its tables."""
    collision, scaling, apart = (ranked(report.tables[f"collision{end}"]) for end in ("", "_scaling", "_apart"))
    labels = [look(row.structure, row.depths).label for row in collision.itertuples()]
    judged = claims_of(report, "collision")
    return {
        "collision": collision.assign(label=labels),
        "rivals": _rivals(collision),
        "over_aabbs": _over_aabbs(collision, "frame_ms"),
        "apart": {time: _over_aabbs(apart, f"{time}_ms", best="query_ms") for time in ("query", "frame")},
        "verdicts": {
            word: joined(counted(rows["verdict"]))
            for word, kind in (("query time", "query"), ("false pairs", "false pairs"))
            if len(rows := judged[judged["claim"].str.startswith(f"the composite tree's {kind}")])
        },
        "exponents": exponents(scaling[~scaling["rival"].astype(bool)])[list(STAGES)],
    }


def _rivals(collision: pd.DataFrame) -> pd.DataFrame:
    """Tabulate how many times the fastest own frame each rival's takes, and the pairs that it gets wrong."""
    rows = []
    for structure, of_structure in collision[collision["rival"].astype(bool)].groupby("structure", sort=False):
        row: dict[str, Any] = {"library": look(str(structure)).label}
        for scene_row in of_structure.itertuples():
            own_frame_ms = tables.where(collision, scene=scene_row.scene, rival=False)["frame_ms"].min()
            row[spaced(str(scene_row.scene))] = scene_row.frame_ms / own_frame_ms
        row |= {
            "pairs missed": of_structure["missed_pairs"].sum(),
            "reported wrongly": of_structure["extra_pairs"].sum(),
        }
        rows.append(row)
    return pd.DataFrame(rows)


def _over_aabbs(table: pd.DataFrame, time: str, best: str = "frame_ms") -> dict[str, Any]:
    """Return the time of spheres and of the composite tree whose time ``best`` is least, over that of AABB trees."""
    own_trees = table[~table["rival"].astype(bool)].groupby(["structure", "depths"])[["query_ms", "frame_ms"]]
    means = own_trees.agg(geometric_mean)
    depths, ratio = means.loc["composite"][best].idxmin(), means[time] / means.loc[("aabb", ""), time]
    return {
        "name": look("composite", depths).label,
        "composite": ratio["composite", depths],
        "spheres": ratio.get(("sphere", "")),
    }
