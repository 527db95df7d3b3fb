"""Tabulate truth.csv: how exactly the truth of each scene is known, and what it took."""

from collections.abc import Callable, Mapping

import numpy as np
import pandas as pd

from palpate.evaluation.tradeoff.truth import OWN, SQUEEZED, Truth

COLUMNS = [
    "scene", "radius_m", "samples", "rejected", "elements", "level", "nodes", "inverted", "rmse_of_peak", "relative_l2",
    "patch_rms_of_peak", "order", "rmse_of_peak_max", "relative_l2_max", "patch_rms_of_peak_max", "ratio_min",
    "ratio_max", "least_det", "squeezed", "volume_change", "newton_iterations", "cg_iterations", "seconds",
    "other_element", "other_element_samples", "why_rejected",
]  # fmt: skip
_MEANS = ("rmse_of_peak", "relative_l2", "patch_rms_of_peak")


def truth_row(scene: str, truth: Truth, other: pd.DataFrame | None = None) -> dict:
    """Return the row of one scene; errors are the truth's own, means and largest of the samples that are believed.

    Only samples that were answered on the finest level count there; those that only choose settings may do without it.

    other : rows of ``other_element.other_element``, whose mean RMSE / peak is the column other_element
    samples, rejected : numbers of samples believed on the finest level, and of all that are not believed
    inverted, squeezed : of all samples, those with an inverted element, or one with a determinant below SQUEEZED
    order : of the mean ratio; ratio_min, ratio_max, least_det : of all samples, rejected ones too
    volume_change : mean of the body's, over its volume at rest, of the samples that count
    newton_iterations, cg_iterations : their means, of all levels of a sample together
    seconds : median time of the solutions of a sample that counts
    """
    refused = ~truth.believed
    kept = truth.believed & np.isfinite(truth.levels[:, -1]).all(axis=(1, 2))
    row = {
        "scene": scene,
        "radius_m": truth.radius_m,
        "samples": int(kept.sum()),
        "rejected": int(refused.sum()),
        "level": truth.level,
    }
    row |= {"elements": truth.elements, "nodes": truth.nodes}
    row |= {"inverted": int((truth.least_det <= 0.0).sum()), "seconds": _of(np.median, truth.seconds[kept])}
    for name in _MEANS:
        values = truth.own[kept, OWN.index(name)]
        row |= {name: _of(np.mean, values), f"{name}_max": _of(np.max, values)}
    row |= {"order": _of(lambda r: np.log2(np.mean(r)), truth.ratio[kept])}
    row |= {"ratio_min": _of(np.min, truth.ratio), "ratio_max": _of(np.max, truth.ratio)}
    row |= {"least_det": _of(np.min, truth.least_det), "squeezed": int((truth.least_det < SQUEEZED).sum())}
    counts = {
        "volume_change": truth.volume_change,
        "newton_iterations": truth.iterations,
        "cg_iterations": truth.products,
    }
    row |= {name: _of(np.mean, values[kept]) for name, values in counts.items()}
    if other is not None and len(other):
        row |= {"other_element": other["rmse_of_peak"].mean(), "other_element_samples": len(other)}
    reasons = zip(truth.sample[refused], truth.rejected[refused], strict=True)
    return row | {"why_rejected": "; ".join(f"{sample}: {why}" for sample, why in reasons)}


def truth_table(truths: Mapping[str, Truth], others: Mapping[str, pd.DataFrame] | None = None) -> pd.DataFrame:
    """Tabulate truth.csv, a row a scene; ``others`` has the checks by another element of the scenes that have them."""
    rows = [truth_row(scene, truth, (others or {}).get(scene)) for scene, truth in truths.items()]
    return pd.DataFrame(rows, columns=COLUMNS)


def _of(function: Callable, values: np.ndarray) -> float:
    values = values[np.isfinite(values)]
    return float(function(values)) if len(values) else np.nan
