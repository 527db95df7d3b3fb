"""Sentences on trees that are stopped at a layer, and on bodies that are apart."""

import numpy as np
import pandas as pd

from palpate.report import tables
from palpate.report.claims import geometric_mean
from palpate.report.number_format import seconds
from palpate.report.words import spaced
from palpate.studies.collision.figures import look


def precision_numbers(stopped: pd.DataFrame, apart: pd.DataFrame) -> dict[str, str]:
    """Return the placeholders of both captions.

    stopped, apart : collision_precision.csv and collision_apart.csv, ranked
    """
    plain = stopped[stopped["structure"] == "aabb"]
    own = apart[~apart["rival"].astype(bool)]
    return {
        "stopped_missed": f"{int(stopped['missed_pairs'].sum()):,}",
        "stopped_half": "; ".join(_half(spaced(s), tables.where(plain, scene=s)) for s in tables.scenes(plain)),
        "stopped_zero": _no_contact(stopped),
        "stopped_reported": "; ".join(_reported(plain)),
        "stopped_exact": "; ".join(_exact(plain)),
        "apart_composite": _composite(own),
        "apart_fastest": "; ".join(_fastest(own)),
        "apart_extra": f"{int(own['extra_pairs'].sum()):,}",
    }


def _half(scene: str, rows: pd.DataFrame) -> str:
    """Compare the deepest layer that takes half of the whole tree's time or less with the whole tree."""
    layers, whole = _split(rows)
    kept = layers[layers["frame_ms"] <= 0.5 * whole["frame_ms"]]
    if kept.empty:
        return f"{scene}: no layer takes half of the time"
    best = kept.loc[kept["layer"].idxmax()]
    return (
        f"{scene}: layer {best['layer']:g}, {seconds(1e-3 * best['frame_ms'])} instead of "
        f"{seconds(1e-3 * whole['frame_ms'])}, response {_mm(best['response_error_m'])} in error instead of "
        f"{_mm(whole['response_error_m'])}"
    )


def _no_contact(stopped: pd.DataFrame) -> str:
    """Count the stopped trees whose response is no better than none, in the scenes with contact."""
    layers = stopped[~stopped["exact"].astype(bool) & (stopped["response_m"] > 0.0)]
    return f"{int((layers['response_error_m'] >= layers['response_m']).sum())} of {len(layers)}"


def _reported(plain: pd.DataFrame) -> list[str]:
    """Return from which distance each layer reports contact, in the scenes where bodies are apart."""
    said = []
    for scene in tables.scenes(plain):
        layers, _ = _split(tables.where(plain, scene=scene))
        if layers["frames_apart"].any():
            each = ", ".join(f"{row.layer:g}: {_mm(row.reported_m)}" for row in layers.itertuples())
            said.append(f"{spaced(scene)}, by layer {each}")
    return said


def _exact(plain: pd.DataFrame) -> list[str]:
    """Return the errors of the contacts of triangles, in the scenes with contact."""
    said = []
    for scene in tables.scenes(plain):
        _, whole = _split(tables.where(plain, scene=scene))
        if np.isfinite(whole["place_error_m"]):
            said.append(
                f"{spaced(scene)}: place {_mm(whole['place_error_m'])}, direction {whole['direction_error_deg']:.2g}°, "
                f"depth {_mm(whole['depth_error_m'])}, velocity {1e3 * whole['velocity_error_m_s']:.2g}\u00a0mm/s"
            )
    return said


def _split(rows: pd.DataFrame) -> tuple[pd.DataFrame, pd.Series]:
    """Return the rows of layers in their order, and the row of the whole tree."""
    exact = rows["exact"].astype(bool)
    return rows[~exact].sort_values("layer"), rows[exact].iloc[0]


def _composite(own: pd.DataFrame) -> str:
    """Compare the composite tree with the least time of a query with AABBs and spheres (geometric means)."""
    means = own.groupby(["structure", "depths"])[["query_ms", "frame_ms"]].agg(geometric_mean)
    best = means.loc["composite", "query_ms"].idxmin()
    plain, one, other = (means.loc[key] for key in (("aabb", ""), ("composite", best), ("sphere", "")))
    query, frame = (one[column] / plain[column] for column in ("query_ms", "frame_ms"))
    alone, with_refit = (other[column] / plain[column] for column in ("query_ms", "frame_ms"))
    return (
        f"a query of {look('composite', best).label}, the fastest composite tree, takes {query:.2f} times as long as "
        f"one of AABBs ({seconds(1e-3 * plain['query_ms'])}), with the refit {frame:.2f} times as long; spheres alone "
        f"take {alone:.2f} and {with_refit:.2f} times as long"
    )


def _fastest(own: pd.DataFrame) -> list[str]:
    """Return the structure of the shortest query at each gap, over both pairs of bodies."""
    said = []
    for gap, rows in own.groupby("gap_m"):
        query = rows.groupby(["structure", "depths"])["query_ms"].agg(geometric_mean)
        structure, depths = query.idxmin()
        said.append(f"{1e3 * gap:g}\u00a0mm: {look(structure, depths).label}, {seconds(1e-3 * query.min())}")
    return said


def _mm(length: float) -> str:
    """Format a length [m] in mm with two significant digits."""
    return f"{float(f'{1e3 * length:.2g}'):g}\u00a0mm"
