"""Tabulate how exactly the truths of touches are known, and every setting of every model with its bounds."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from palpate.benchmark.conformal import Draws, bound_factor, finite
from palpate.benchmark.ranking import TRUTH
from palpate.benchmark.touch_measure import SIGNED
from palpate.benchmark.touch_truth import TouchErrors, TouchTruth
from palpate.benchmark.truth import over, reasons
from palpate.table_declaration import Table

TOUCH_TRUTH = Table(
    "touch_truth",
    "How exactly the truth of each instrument on each body is known, and what it takes.",
    """
    scene body instrument radius_m edge_m length_m: a body under an instrument, and the lengths of that [m]
    samples rejected: touches whose truth is believed, and the others
    lowered: touches that were made less deep than drawn, as the body gives way there
    depth_min_m depth_max_m: between which the depths lie, from first touch [m]
    force_min_n force_max_n: between which the forces lie [N]
    rmse_of_peak patch_rms_of_peak: means of the truth's own errors, over the surface and in the dent [peak]
    force_error stiffness_error area_error: means of its own errors of the force, its slope over depth, and the area
        that touches, over these
    rmse_of_peak_max patch_rms_of_peak_max force_error_max stiffness_error_max area_error_max: the greatest of each
    order force_order: medians of the observed orders of convergence, of the displacement and of the force
    overlap least_det: largest mean overlap with the instrument over the depth, and least determinant of F
    nodes mesh_edge_m: of the finest mesh, the most nodes, and the longest edge where it is touched [m]
    seconds: of a touch, the median time [s]
    why_rejected: the reasons, with their counts
    """,
)
TOUCH_FORCES = Table(
    "touch_forces",
    "The truth of each touch: what the instrument's hand feels, and how exactly that is known.",
    """
    scene body instrument radius_m edge_m length_m sticks: a body under an instrument
    sample node x_m y_m z_m: the touch, and the surface node at the instrument's tip [m]
    direction_x direction_y direction_z depth_m: of its way, from first touch [m]
    force_n force_error: along that way, and its own error over it [N]
    force_before_n: at 0.8 of the depth [N]
    area_m2 area_error pressure_pa: that touches, its own error over it, and the greatest pressure [m², Pa]
    rmse_of_peak: own error of the surface [peak]
    order force_order: observed orders of convergence
    rejected: why it judges no model
    """,
)
_OWN = {
    "rmse_of_peak": "rmse_of_peak",
    "patch_rms_of_peak": "patch_rms_of_peak",
    "force_error": "force_error",
    "stiffness_error": "stiffness_error",
    "contact_area_error": "area_error",
}
"""The own errors that are tabulated, by their names among the errors of an answer."""
TOUCH = Table(
    "touch",
    "The errors against the truth, the time, the preparation and the memory of every model at each of its settings.",
    """
    scene body instrument radius_m: a body under an instrument, and the radius of that [m]
    model setting: what answers
    sees prepared law: what it is given, whether it prepares each place, and its law
    samples failures rejected: touches, those without an answer, and those without a truth, which are not asked
    rmse_of_peak patch_rms_of_peak patch_max_of_peak max_of_peak: mean errors over the surface, and in the dent,
        which is what lies within a radius of the instrument from where it first touches [peak]
    force_error stiffness_error contact_area_error: mean errors with their sign, over the truth's own: of the force at
        the depth asked, of its slope over depth, and of the area that touches; empty where a model does not tell it
    force_error_size stiffness_error_size contact_area_error_size: means of these without their sign
    rmse_of_peak_median rmse_of_peak_p95 patch_rms_of_peak_median patch_rms_of_peak_p95: medians and 95th percentiles
    force_error_median force_error_p95 stiffness_error_median stiffness_error_p95: the same, without the sign
    contact_area_error_median contact_area_error_p95: the same, without the sign
    rmse_of_peak_bound patch_rms_of_peak_bound force_error_bound: below which the error at another place stays in nine
        cases of ten, with the truth's own error; empty where fewer than nine touches are known
    force_error_coverage: share of the touches that stay below such a bound of others; empty below ten touches
    penetration_of_depth: the deepest overlap of a surface node with the instrument, over the depth; empty of a grasp
    reaction_error: mean error of the force as the body's supports feel it
    online_median_s online_p95_s online_max_s: time of an answer, and of the slowest touch (median of its calls) [s]
    preparation_s offline_s memory_mb: preparation of a place and of the body [s], and memory [1e6 bytes]
    threads failure: threads, and the first reason of a failure
    """,
)
BOUNDED = ("rmse_of_peak", "patch_rms_of_peak", "force_error")
"""Errors that have a bound."""


class Known(NamedTuple):
    """An instrument on a body: what was asked, and the truth of it.

    labels : scene, body, instrument and its lengths; touches : the rows of its table; places : (k, 3) [m]
    """

    labels: dict[str, Any]
    touches: pd.DataFrame
    truth: TouchTruth
    places: np.ndarray


def touch_truth_row(known: Known) -> dict[str, Any]:
    """Return the row of TOUCH_TRUTH of one scene; its figures are of the touches that are believed."""
    truth, kept = known.truth, known.truth.believed
    row = known.labels | {"samples": int(kept.sum()), "rejected": int((~kept).sum())}
    depth = known.touches["depth_m"].to_numpy()
    row |= {"lowered": int((depth < (1.0 - 1e-9) * known.touches["asked_m"].to_numpy()).sum())}
    for name, column in _OWN.items():
        own = truth.own[kept, TouchErrors._fields.index(name)]
        row |= {column: over(np.mean, own), f"{column}_max": over(np.max, own)}
    for name, values in (("depth", depth), ("force", truth.force[:, -1])):
        unit = "m" if name == "depth" else "n"
        row |= {f"{name}_min_{unit}": over(np.min, values[kept]), f"{name}_max_{unit}": over(np.max, values[kept])}
    row |= {name: over(np.median, getattr(truth, name)[kept]) for name in ("order", "force_order")}
    row |= {"overlap": over(np.max, truth.overlap[kept]), "least_det": over(np.min, truth.least_det[kept])}
    row |= {
        "nodes": int(truth.nodes.max()),
        "mesh_edge_m": over(np.max, truth.edge_m),
        "seconds": np.median(truth.seconds),
    }
    return row | {"why_rejected": "; ".join(f"{count} {why}" for why, count in reasons(truth.rejected).items())}


def touch_truth_table(scenes: Sequence[Known]) -> pd.DataFrame:
    """Tabulate TOUCH_TRUTH, a row a scene."""
    return TOUCH_TRUTH.frame(map(touch_truth_row, scenes))


def touch_forces_table(scenes: Sequence[Known]) -> pd.DataFrame:
    """Tabulate TOUCH_FORCES, a row a touch."""
    return TOUCH_FORCES.frame(row for known in scenes for row in _force_rows(known))


def _force_rows(known: Known) -> list[dict[str, Any]]:
    truth = known.truth
    told = {"force_n": truth.force[:, 1], "force_before_n": truth.force[:, 0], "area_m2": truth.area}
    told |= {name: getattr(truth, name) for name in ("order", "force_order", "rejected")}
    told |= {"pressure_pa": truth.pressure} | dict(zip(("x_m", "y_m", "z_m"), known.places.T, strict=True))
    for name in ("force_error", "contact_area_error", "rmse_of_peak"):
        told[_OWN[name]] = truth.own[:, TouchErrors._fields.index(name)]
    table = known.touches.drop(columns="asked_m").assign(**told)
    return [known.labels | row for row in table.to_dict("records")]


def touch_table(settings: pd.DataFrame, samples: pd.DataFrame) -> pd.DataFrame:
    """Add to the rows of all settings the means of errors without a sign, and bounds: the rows of TOUCH.

    samples : the errors of each touch, the truth's own among them
    """
    own = samples[samples["model"] == TRUTH].set_index(["scene", "sample"])[list(BOUNDED)]
    keys = ["scene", "model", "setting"]
    rows = {names: _spread(part, own) for names, part in samples.groupby(keys, sort=False)}
    more = pd.DataFrame([rows.get(names, {}) for names in settings[keys].itertuples(index=False, name=None)])
    return pd.concat([settings.reset_index(drop=True), more], axis=1).reindex(columns=TOUCH.columns)


def _spread(part: pd.DataFrame, own: pd.DataFrame) -> dict[str, float]:
    """Return means and bounds of one setting in one scene, the truth's own error added to models'."""
    answered = part[part["failure"].fillna("") == ""]
    row = {f"{name}_size": answered[name].astype(float).abs().mean() for name in SIGNED}
    places = pd.MultiIndex.from_frame(answered[["scene", "sample"]])
    itself = 0.0 if (part["model"] == TRUTH).all() else own.reindex(places).to_numpy(dtype=float)
    errors = answered[list(BOUNDED)].to_numpy(dtype=float)
    errors, whole = np.abs(errors) + itself, len(answered) == len(part)
    touch = answered["sample"].to_numpy()
    for name, values in zip(BOUNDED, errors.T, strict=True):
        known = whole and np.isfinite(values).all()
        row[f"{name}_bound"] = finite(bound_factor(values, touch)) if known else np.nan
        if known and name == "force_error":
            row |= {"force_error_coverage": Draws(touch).coverage(values, np.ones(len(values))).coverage}
    return row
