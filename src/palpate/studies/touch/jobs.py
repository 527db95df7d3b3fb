"""Functions that workflow/rules/touch.smk calls (workflow/job.py says how), and the tables they write."""

from collections.abc import Callable
from dataclasses import asdict
from typing import Any

import numpy as np
import pandas as pd

from palpate.benchmark.conformal import Draws, bound_factor, finite
from palpate.benchmark.measuring import measure, tables
from palpate.benchmark.ranking import TRUTH
from palpate.benchmark.settings import Given, TouchTruthSettings
from palpate.benchmark.touch import TouchCase, TouchErrors, TouchTruth, choose_touches, given_touches, touches_of
from palpate.benchmark.touch_measure import SIGNED, TOUCH, Touches, touch_settings, truth_rows
from palpate.benchmark.touch_mesh import check_by_coarse_elements
from palpate.benchmark.touch_truth import truth_of_touches
from palpate.benchmark.truth import over, reasons
from palpate.bodies.body import Body
from palpate.effects.instrument import Instrument
from palpate.models.own_model import own_settings
from palpate.run.job import free_mb, write_table
from palpate.stores import store
from palpate.studies.touch.settings import Families
from palpate.table_declaration import Table


def simulate_touch_truth(
    body: Body, output, say, progress: Callable, instrument: Instrument, truth: TouchTruthSettings, at: list[Given],
    samples: int, depth_of_radius: tuple[float, float], seed: int,
):  # fmt: skip
    """Choose the touches of a body by an instrument, and find the truth of each."""
    if at:
        table = given_touches(body, instrument, at)
    else:
        bears = check_by_coarse_elements(body, truth.along_radius)
        table = choose_touches(body, instrument, samples, depth_of_radius, seed, bears)
    write_table(table, output.touches)
    touches = touches_of(instrument, pd.read_csv(output.touches))
    store(truth_of_touches(body, touches, progress, truth, say, free_mb()), output.truth)


BUDGET_S = 0.1
"""Time [s] for which each setting is asked again, beyond once for each touch."""


def measure_touch_models(
    body: Body, touches: pd.DataFrame, truth: TouchTruth, wildcards, instrument: Instrument, place: str,
    deepest_of_radius: float, keywords: dict, settings: Families, repeats: int, seed: int, progress: Callable,
):  # fmt: skip
    """Measure all settings of one model on the touches of a body by an instrument."""
    deepest = max([deepest_of_radius * instrument.radius_m, *touches["depth_m"]])
    case, name = TouchCase(body, instrument, deepest, seed, settings), wildcards.model
    if place.endswith(".py"):
        tried = own_settings(name, place, "touch", body, instrument.name, instrument.radius_m, seed, progress)
    else:
        tried = touch_settings(case, name, place, progress, **keywords)
    kind = Touches(case, touches_of(instrument, touches), truth, place)
    measured = tables(kind, *measure(kind, tried, repeats, BUDGET_S))
    return dict(zip(("samples", "settings"), measured, strict=True))


def tabulate_touch(
    bodies: list[Body], touches: list[pd.DataFrame], truths: list[TouchTruth], instruments: list[Instrument],
    samples: list[pd.DataFrame], settings: list[pd.DataFrame],
):  # fmt: skip
    """Tabulate how exactly truths are known, the force of each touch, and all settings with their bounds.

    touches, truths : of each pair of ``bodies`` and ``instruments``; samples, settings : the tables of all models
    """
    of_truths, forces, errors, means = [], [], [], []
    for body, table, truth, instrument in zip(bodies, touches, truths, instruments, strict=True):
        case = TouchCase(body, instrument, table["depth_m"].max(), 0)
        own_errors, row = truth_rows(case, touches_of(instrument, table), truth)
        labels = row[["scene", "body", "instrument"]].iloc[0].to_dict() | asdict(instrument)
        of_truths.append(touch_truth_row(labels, table, truth))
        forces += touch_force_rows(labels, table, truth, body.fine.nodes[table["node"]])
        errors.append(own_errors)
        means.append(row)
    touch = touch_table(_joined([*means, *settings]), _joined([*errors, *samples]))
    return {"truth": TOUCH_TRUTH.frame(of_truths), "forces": TOUCH_FORCES.frame(forces), "touch": touch}


def _joined(parts: list[pd.DataFrame]) -> pd.DataFrame:
    """Join tables, of which some may have no rows."""
    return pd.concat([part for part in parts if len(part)] or parts[:1], ignore_index=True)


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
BOUNDED = ("rmse_of_peak", "patch_rms_of_peak", "force_error")
"""Errors that have a bound."""


def touch_truth_row(labels: dict[str, Any], touches: pd.DataFrame, truth: TouchTruth) -> dict[str, Any]:
    """Return the row of TOUCH_TRUTH of one scene; its means and extremes are over touches whose truth is believed.

    labels : scene, body, instrument and its lengths; touches : k rows with TOUCH_COLUMNS
    """
    sound = truth.believed
    row = labels | {"samples": int(sound.sum()), "rejected": int((~sound).sum())}
    depth = touches["depth_m"].to_numpy()
    row |= {"lowered": int((depth < (1.0 - 1e-9) * touches["asked_m"].to_numpy()).sum())}
    for name, column in _OWN.items():
        errors = truth.own[sound, TouchErrors._fields.index(name)]
        row |= {column: over(np.mean, errors), f"{column}_max": over(np.max, errors)}
    for name, values in (("depth", depth), ("force", truth.force[:, -1])):
        unit = "m" if name == "depth" else "n"
        row |= {f"{name}_min_{unit}": over(np.min, values[sound]), f"{name}_max_{unit}": over(np.max, values[sound])}
    row |= {name: over(np.median, getattr(truth, name)[sound]) for name in ("order", "force_order")}
    row |= {"overlap": over(np.max, truth.overlap[sound]), "least_det": over(np.min, truth.least_det[sound])}
    row |= {
        "nodes": int(truth.nodes.max()),
        "mesh_edge_m": over(np.max, truth.edge_m),
        "seconds": np.median(truth.seconds),
    }
    return row | {"why_rejected": "; ".join(f"{count} {why}" for why, count in reasons(truth.rejected).items())}


def touch_force_rows(
    labels: dict[str, Any], touches: pd.DataFrame, truth: TouchTruth, places: np.ndarray
) -> list[dict[str, Any]]:
    """Return the rows of TOUCH_FORCES of one scene, a row a touch.

    labels, touches : as of ``touch_truth_row``; places : (k, 3) [m] of the nodes that are touched
    """
    columns = {"force_n": truth.force[:, 1], "force_before_n": truth.force[:, 0], "area_m2": truth.area}
    columns |= {name: getattr(truth, name) for name in ("order", "force_order", "rejected")}
    columns |= {"pressure_pa": truth.pressure} | dict(zip(("x_m", "y_m", "z_m"), places.T, strict=True))
    for name in ("force_error", "contact_area_error", "rmse_of_peak"):
        columns[_OWN[name]] = truth.own[:, TouchErrors._fields.index(name)]
    table = touches.drop(columns="asked_m").assign(**columns)
    return [labels | row for row in table.to_dict("records")]


def touch_table(settings: pd.DataFrame, samples: pd.DataFrame) -> pd.DataFrame:
    """Add means of errors without their sign and bounds of errors to the rows of all settings; return TOUCH.

    samples : rows of touches with their errors, those of the truth itself among them
    """
    own_errors = samples[samples["model"] == TRUTH].set_index(["scene", "sample"])[list(BOUNDED)]
    keys = ["scene", "model", "setting"]
    rows = {names: _mean_sizes_and_bounds(part, own_errors) for names, part in samples.groupby(keys, sort=False)}
    bounds = pd.DataFrame([rows.get(names, {}) for names in settings[keys].itertuples(index=False, name=None)])
    other_columns = settings.reset_index(drop=True).drop(columns=bounds.columns, errors="ignore")
    return pd.concat([other_columns, bounds], axis=1)[TOUCH.columns]


def _mean_sizes_and_bounds(part: pd.DataFrame, own_errors: pd.DataFrame) -> dict[str, float]:
    """Return means of absolute errors of one setting in one scene, and bounds that a touch elsewhere stays below.

    part : its rows of touches; own_errors : the truth's, by scene and sample, which are added to those of models
    Bounds are NaN where a touch has no answer.
    """
    answered = part[part["failure"].fillna("") == ""]
    row = {f"{name}_size": answered[name].astype(float).abs().mean() for name in SIGNED}
    places = pd.MultiIndex.from_frame(answered[["scene", "sample"]])
    of_truth = 0.0 if (part["model"] == TRUTH).all() else own_errors.reindex(places).to_numpy(dtype=float)
    errors = answered[list(BOUNDED)].to_numpy(dtype=float)
    errors, all_answered = np.abs(errors) + of_truth, len(answered) == len(part)
    touch = answered["sample"].to_numpy()
    for name, values in zip(BOUNDED, errors.T, strict=True):
        known = all_answered and np.isfinite(values).all()
        row[f"{name}_bound"] = finite(bound_factor(values, touch)) if known else np.nan
        if known and name == "force_error":
            # the bound is one number for all touches, so that the estimate of each is 1
            row |= {"force_error_coverage": Draws(touch).coverage(values, np.ones(len(values))).coverage}
    return row
