"""Tabulate truth.csv: how exactly the truth of each scene is known, and what it took."""

from collections.abc import Callable, Mapping

import numpy as np
import pandas as pd

from palpate.benchmark.comparison import KINDS
from palpate.benchmark.truth import OWN, SQUEEZED, Truth

COLUMNS = [
    "scene", "radius_m", "samples", "rejected", "elements", "level", "nodes", "inverted", "rmse_of_peak", "relative_l2",
    "patch_rms_of_peak", "order", "rmse_of_peak_max", "relative_l2_max", "patch_rms_of_peak_max", "ratio_min",
    "ratio_max", "least_det", "squeezed", "volume_change", "iterations", "cycles", "seconds",
    "validation_samples", "validation_rmse_of_peak", "validation_patch_rms_of_peak", "other_element",
    "other_element_patch", "other_element_samples", "other_element_own", "other_element_own_patch", "geometry_of_peak",
    "geometry_patch_of_peak", "geometry_samples", "why_rejected",
]  # fmt: skip
_MEANS = ("rmse_of_peak", "relative_l2", "patch_rms_of_peak")


def truth_row(
    scene: str, truth: Truth, other: pd.DataFrame | None = None, geometry: pd.DataFrame | None = None
) -> dict:
    """Return the row of one scene; errors are the truth's own, means and largest of the samples that are believed.

    Only samples that were answered on the finest level count there; those that only choose settings may do without it,
    and then have a larger error, in columns of their own: validation_samples, and two means that are empty without any.

    other : rows of ``other_element.other_element``, whose mean RMSE / peak is the column other_element, and that of
        their patches other_element_patch; other_element_own, other_element_own_patch : the truth's own, of these alone
    geometry : rows of ``geometry.geometry_share``, whose means are geometry_of_peak (RMSE) and geometry_patch_of_peak
    samples, rejected : numbers of samples believed on the finest level, and of all that are not believed
    inverted, squeezed : of all samples, those with an inverted element, or one with a determinant below SQUEEZED
    order : of the mean ratio; ratio_min, ratio_max, least_det : of all samples, rejected ones too
    volume_change : mean of the body's, over its volume at rest, of the samples that count
    iterations, cycles : means of those of L-BFGS and Newton's method, and of multigrid cycles, of a sample's levels
        together
    seconds : median time of the solutions of a sample that counts
    """
    refused = ~truth.believed
    kept = truth.believed & np.isfinite(truth.levels[:, -1]).all(axis=(1, 2))
    row = {"scene": scene, "samples": int(kept.sum()), "rejected": int(refused.sum())}
    row |= _counted(truth, kept)
    less = truth.believed & ~kept & np.isfinite(truth.displacement).all(axis=(1, 2))
    row |= {"validation_samples": int(less.sum())}
    row |= _own(truth, less, "validation_{}")
    if other is not None and len(other):
        own = _own(truth, np.isin(truth.sample, other["sample"]), "{}")
        row |= _means(other, "other_element", "other_element_patch")
        row |= {"other_element_own": own["rmse_of_peak"], "other_element_own_patch": own["patch_rms_of_peak"]}
    if geometry is not None and len(geometry):
        row |= _means(geometry, "geometry_of_peak", "geometry_patch_of_peak")
    reasons = zip(truth.sample[refused], truth.rejected[refused], strict=True)
    return row | {"why_rejected": "; ".join(f"{sample}: {why}" for sample, why in reasons)}


def _counted(truth: Truth, kept: np.ndarray) -> dict[str, float]:
    """Return what the scene was answered on, and the figures of the samples ``kept`` (k,) bool, or of all of them."""
    row = {"radius_m": truth.radius_m, "level": truth.level, "elements": truth.elements, "nodes": truth.nodes}
    row |= {"inverted": int((truth.least_det <= 0.0).sum()), "squeezed": int((truth.least_det < SQUEEZED).sum())}
    for name in _MEANS:
        values = truth.own[kept, OWN.index(name)]
        row |= {name: _of(np.mean, values), f"{name}_max": _of(np.max, values)}
    row |= {"order": _of(lambda r: np.log2(np.mean(r)), truth.ratio[kept])}
    row |= {"ratio_min": _of(np.min, truth.ratio), "ratio_max": _of(np.max, truth.ratio)}
    row |= {"least_det": _of(np.min, truth.least_det), "seconds": _of(np.median, truth.seconds[kept])}
    counts = {"volume_change": truth.volume_change, "iterations": truth.iterations, "cycles": truth.products}
    return row | {name: _of(np.mean, values[kept]) for name, values in counts.items()}


def _means(rows: pd.DataFrame, name: str, patch: str) -> dict:
    """Return the means of a comparison under the names of its columns, and of how many samples they are."""
    means = rows[["rmse_of_peak", "patch_rms_of_peak"]].mean()
    samples = f"{name.removesuffix('_of_peak')}_samples"
    return {name: means["rmse_of_peak"], patch: means["patch_rms_of_peak"], samples: len(rows)}


def truth_table(
    truths: Mapping[str, Truth],
    others: Mapping[str, pd.DataFrame] | None = None,
    shares: Mapping[str, pd.DataFrame] | None = None,
) -> pd.DataFrame:
    """Tabulate truth.csv, a row a scene.

    others : the checks by another element of the scenes that have them; shares : what facets change, likewise
    """
    rows = [
        truth_row(scene, truth, (others or {}).get(scene), (shares or {}).get(scene)) for scene, truth in truths.items()
    ]
    return pd.DataFrame(rows, columns=COLUMNS)


def _own(truth: Truth, samples: np.ndarray, name: str) -> dict[str, float]:
    """Return the means of the truth's own errors that advice goes by, of ``samples`` (k,) bool, with their ``name``."""
    return {name.format(kind): _of(np.mean, truth.own[samples, OWN.index(kind)]) for kind in KINDS.values()}


def _of(function: Callable, values: np.ndarray) -> float:
    values = values[np.isfinite(values)]
    return float(function(values)) if len(values) else np.nan
