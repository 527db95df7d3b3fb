"""Report on paper 3, chapter 4: bounding structures compared, stopped early, between bodies apart, and as they grow."""

from collections.abc import Iterator
from typing import Any

import pandas as pd

from palpate.report import tables
from palpate.report.claims import geometric_mean
from palpate.report.closing import claims_of, counted, joined
from palpate.report.report import Report
from palpate.report.words import spaced
from palpate.studies.collision.compare_trees import STAGES, exponents
from palpate.studies.collision.figures import look, ranked

TITLE = "Paper 3: collision"


def numbers(report: Report) -> dict[str, Any]:
    """Return what the template names."""
    collision, scaling, stopped, apart = (
        ranked(report.tables[f"collision{end}"]) for end in ("", "_scaling", "_precision", "_apart")
    )
    own = collision[~collision["rival"].astype(bool)]
    fits, judged = exponents(scaling[~scaling["rival"].astype(bool)]), claims_of(report, "collision")
    return {
        "livers": _frames(tables.where(collision, scene="two_livers")),
        "scenes": [_frames(tables.where(collision, scene=scene)) for scene in tables.scenes(own)],
        "wrong": int(own["missed_pairs"].sum() + own["extra_pairs"].sum()),
        "frames": int(own["frames"].sum()),
        "rivals": _rivals(collision),
        "composite": _ratio(own, "frame_ms"),
        "composite_name": look("composite", _best(own, "frame_ms")).label,
        "verdicts": {
            word: joined(counted(rows["verdict"]))
            for word, kind in (("query time", "query"), ("false pairs", "false pairs"))
            if len(rows := judged[judged["claim"].str.startswith(f"the composite tree's {kind}")])
        },
        "exponents": [(stage.removesuffix("_ms"), fits[stage].min(), fits[stage].max()) for stage in STAGES],
        **_stopped(stopped),
        **_apart(apart),
    }


def _label(row: pd.Series) -> str:
    return look(row["structure"], row["depths"]).label


def _frames(rows: pd.DataFrame) -> dict[str, Any]:
    """Return the fastest own structure's frame in one scene, and the frames of the rivals [s]."""
    rivals = rows["rival"].astype(bool)
    best = rows[~rivals].loc[rows[~rivals]["frame_ms"].idxmin()]
    return {
        "name": spaced(str(best["scene"])),
        "triangles": int(best["triangles"]),
        "fastest": _label(best),
        "frame_s": 1e-3 * best["frame_ms"],
        "rivals": {_label(row): 1e-3 * row["frame_ms"] for _, row in rows[rivals].iterrows()},
    }


def _rivals(collision: pd.DataFrame) -> pd.DataFrame:
    """Tabulate how many times the fastest own frame each rival's takes, and the pairs that it gets wrong."""
    rows = []
    for structure, found in collision[collision["rival"].astype(bool)].groupby("structure", sort=False):
        row: dict[str, Any] = {"library": look(str(structure)).label}
        for one in found.itertuples():
            least = tables.where(collision, scene=one.scene, rival=False)["frame_ms"].min()
            row[spaced(str(one.scene))] = one.frame_ms / least
        row |= {"pairs missed": found["missed_pairs"].sum(), "reported wrongly": found["extra_pairs"].sum()}
        rows.append(row)
    return pd.DataFrame(rows)


def _best(own: pd.DataFrame, column: str) -> str:
    """Return the depths of the composite tree with the least geometric mean."""
    return str(own.groupby(["structure", "depths"])[column].agg(geometric_mean).loc["composite"].idxmin())


def _ratio(own: pd.DataFrame, column: str, structure: str = "composite", best: str = "") -> float:
    """Return the time of a structure over that of AABB trees, of composite trees the least or of the ``best``."""
    means = own.groupby(["structure", "depths"])[column].agg(geometric_mean)
    depths = (best or _best(own, column)) if structure == "composite" else ""
    return float(means[structure, depths] / means["aabb", ""])


def _stopped(stopped: pd.DataFrame) -> dict[str, Any]:
    """Return what it costs to stop AABB trees early, and what triangles give, by scene; lengths in mm."""
    plain = stopped[stopped["structure"] == "aabb"]
    layers = stopped[~stopped["exact"].astype(bool) & (stopped["response_m"] > 0.0)]
    found = {scene: _split(tables.where(plain, scene=scene)) for scene in tables.scenes(plain)}
    return {
        "stopped_missed": int(stopped["missed_pairs"].sum()),
        "stopped_no_better": int((layers["response_error_m"] >= layers["response_m"]).sum()),
        "stopped_settings": len(layers),
        "half_of_the_time": [_half(spaced(scene), *rows) for scene, rows in found.items()],
        "reported": [
            (spaced(scene), [(int(row.layer), 1e3 * row.reported_m) for row in rows.itertuples()])
            for scene, (rows, _) in found.items()
            if rows["frames_apart"].any()
        ],
        "exact": pd.DataFrame([_exact(spaced(s), whole) for s, (_, whole) in found.items() if whole["response_m"] > 0]),
    }


def _split(rows: pd.DataFrame) -> tuple[pd.DataFrame, pd.Series]:
    exact = rows["exact"].astype(bool)
    return rows[~exact].sort_values("layer"), rows[exact].iloc[0]


def _half(scene: str, layers: pd.DataFrame, whole: pd.Series) -> dict[str, Any]:
    """Return the deepest layer that takes at most half of the time of the whole tree, and its error."""
    kept = layers[layers["frame_ms"] <= 0.5 * whole["frame_ms"]]
    if kept.empty:
        return {"scene": scene, "layer": None}
    best = kept.loc[kept["layer"].idxmax()]
    return {
        "scene": scene,
        "layer": int(best["layer"]),
        "seconds": (1e-3 * best["frame_ms"], 1e-3 * whole["frame_ms"]),
        "error_mm": (1e3 * best["response_error_m"], 1e3 * whole["response_error_m"]),
    }


def _exact(scene: str, whole: pd.Series) -> dict[str, Any]:
    return {
        "scene": scene,
        "place [mm]": 1e3 * whole["place_error_m"],
        "direction [°]": whole["direction_error_deg"],
        "depth [mm]": 1e3 * whole["depth_error_m"],
        "velocity [mm/s]": 1e3 * whole["velocity_error_m_s"],
    }


def _apart(apart: pd.DataFrame) -> dict[str, Any]:
    """Return the fastest structure at each gap, and what the composite tree takes beside AABBs."""
    own = apart[~apart["rival"].astype(bool)]
    fastest = []
    for gap, rows in own.groupby("gap_m"):
        query = rows.groupby(["structure", "depths"])["query_ms"].agg(geometric_mean)
        fastest.append((1e3 * float(gap), look(*query.idxmin()).label, 1e-3 * query.min()))
    best = _best(own, "query_ms")
    return {
        "apart_extra": int(own["extra_pairs"].sum()),
        "apart_fastest": fastest,
        "apart_composite": look("composite", best).label,
        "apart_query": [_ratio(own, "query_ms", kind, best) for kind in ("composite", "sphere")],
        "apart_frame": [_ratio(own, "frame_ms", kind, best) for kind in ("composite", "sphere")],
    }


def failures(report: Report) -> Iterator[tuple[str, str, str]]:
    """Yield the structures that missed crossing pairs or reported wrong ones: what, where, how."""
    table = report.tables["collision"]
    for row in ranked(table[table["missed_pairs"] + table["extra_pairs"] > 0]).itertuples():
        how = f"{int(row.missed_pairs):,} crossing pairs missed, {int(row.extra_pairs):,} reported wrongly"
        yield look(row.structure, row.depths).label, spaced(row.scene), how
