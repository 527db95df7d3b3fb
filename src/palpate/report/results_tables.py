"""Make the tables of docs/results.md from those of a run: few rows, with numbers as text."""

import pandas as pd

from palpate.report import tables
from palpate.report.law_looks import label as changed_to
from palpate.report.model_looks import label, look
from palpate.report.number_format import percent, seconds
from palpate.studies.law.compare_laws import OWN
from palpate.studies.measured.figures import GIVEN, named
from palpate.studies.tradeoff.advice import NONE
from palpate.studies.tradeoff.advice_agreement import same_in
from palpate.studies.tradeoff.advice_words import behind, error_of, interval, limit
from palpate.studies.tradeoff.figures.scene_rows import first_split

BESIDES = ("integrator", "held")
"""Rows of the table of effects that are no effect of their own, or without which a body is not that scene's."""


def advice(advice: pd.DataFrame) -> pd.DataFrame:
    """Return a row for each limit that was asked for: model, error, time, and the next best model; of the first split.

    Of each limit there is a row for each kind of error that was asked about. Where there are several splits, a column
    counts those that advise the same.
    """
    rows, counts = [], []
    every = advice.groupby(["scene", "error", "budget_ms", "max_error", "speed"], sort=False, dropna=False)
    for _, asked in every:
        row = first_split(asked).iloc[0]
        same, splits = same_in(asked.sort_values("split", kind="stable"))
        counts.append(f"{same} of {splits}" if splits > 1 else "")
        if row["model"] == NONE:
            rows.append([row["scene"], row["error"], limit(row), NONE, "", "", ""])
            continue
        model, error = label(row["model"], row["setting"]), f"{percent(error_of(row))} ({interval(row)})"
        time = seconds(row["online_p95_s"])
        rows.append([row["scene"], row["error"], limit(row), model, error, time, _next_best(row)])
    names = ["scene", "error of", "asked", "take", "error", "95th percentile of time", "next best"]
    found = pd.DataFrame(rows, columns=names)
    return found.assign(splits=counts) if any(counts) else found


def _next_best(row: pd.Series) -> str:
    return f"{label(row['rival'], 'default')} {behind(row)}" if row["factor"] > 0 else ""


def truth(truth: pd.DataFrame) -> pd.DataFrame:
    """Return how well the truth of each scene is known, and the mesh that it takes."""
    errors = {"RMSE": "rmse_of_peak", "at the patch": "patch_rms_of_peak", "relative L2": "relative_l2"}
    found = truth[["scene", "samples"]].assign(**{name: truth[column].map(percent) for name, column in errors.items()})
    found = found.assign(order=truth["order"].map("{:.2g}".format), inverted=truth["inverted"])
    return found.assign(elements=truth["elements"].map("{:,}".format))


def agreement(agreed: pd.DataFrame) -> pd.DataFrame:
    """Return for each scene and kind of error in how many splits the same model is advised, a column for each limit."""
    text = [
        f"{label(row['model'], 'default')} {row['same']} of {row['splits']}" if row["model"] != NONE else NONE
        for _, row in agreed.iterrows()
    ]
    return _by_limit(agreed.assign(text=text), ["scene", "error"])


def by_radius(advised: pd.DataFrame) -> pd.DataFrame:
    """Return what is advised for each radius of the finger, a column for each limit; a flip is marked by an arrow."""
    text = [
        f"{'→ ' if row['flips'] else ''}{label(row['model'], 'default')}"
        + (f" {percent(error_of(row))}" if row["model"] != NONE else "")
        for _, row in advised.iterrows()
    ]
    found = advised.assign(text=text, radius=advised["radius_m"].map(lambda radius: f"{1e3 * radius:g} mm"))
    return _by_limit(found, ["body", "error", "radius"])


def law(law: pd.DataFrame) -> pd.DataFrame:
    """Return what each change of a body is worth at its deepest presses, beside the errors of linear elements."""
    rows = []
    for (body, changed, *names), part in law.groupby(["body", "changed", "law", "poisson"], sort=False):
        deepest = part[part["depth_of_size"] == part.groupby("contact")["depth_of_size"].transform("max")]
        if changed == OWN or not deepest["change_rmse_of_peak"].notna().any():
            continue
        columns = ("change_rmse_of_peak", "change_patch_rms_of_peak", "linear_rmse_of_peak", "linear_patch_rms_of_peak")
        own = span(deepest["own_rmse_of_peak"])
        known = own if deepest["believed"].astype(bool).all() else f"{own}, not believed"
        depth = percent(deepest["depth_of_size"].mean())
        rows.append([body, changed_to(changed, *names), depth, *(span(deepest[each]) for each in columns), known])
    names = ["body", "changed to", "depth", "changes", "at the patch", "linear elements", "at the patch ", "truth"]
    return pd.DataFrame(rows, columns=names)


def measured(measured: pd.DataFrame) -> pd.DataFrame:
    """Return the errors of fitted models in the cases that they were not fitted to, a column for each quantity."""
    rows = measured[
        measured["error"].notna()
        & measured["marker"].eq("all")
        & measured["calibrated"].ne(GIVEN)
        & measured["calibrated"].ne(measured["case"])
        & measured["quantity"].isin(["sink_m", "frequency_hz"])
    ]
    keys = ["experiment", "case", "model", "setting", "nodes"]
    found = []
    for (experiment, case, *_), part in rows.groupby(keys, sort=False):
        errors = part.set_index("quantity")
        told = [
            f"{100 * errors['error'][each]:+.1f} %" if each in errors.index else ""
            for each in ("sink_m", "frequency_hz")
        ]
        apart = [percent(value) for value in (errors["repeat"] / errors["measured"]).dropna()]
        found.append([experiment, case, named(part.iloc[0]), *told, ", ".join(apart)])
    return pd.DataFrame(found, columns=["experiment", "case", "model", "place", "frequency", "repeats differ"])


def palpation(palpation: pd.DataFrame) -> pd.DataFrame:
    """Return how much stiffer each place is under the largest force, and whether that is felt."""
    rows = palpation[palpation["force_n"] == palpation.groupby(["body", "contact"])["force_n"].transform("max")]
    cover = rows["cover_m"].map(lambda metres: f"{1e3 * metres:.3g} mm")
    felt = rows["felt"].map(lambda felt: "yes" if felt else "no")
    return pd.DataFrame(
        {"body": rows["body"], "distance": cover, "stiffer": rows["stiffer"].map(percent), "felt": felt}
    )


def span(values: pd.Series) -> str:
    """Return the least and the most of shares, in per cent; one number where they are the same."""
    known = values.dropna()
    return " to ".join(dict.fromkeys(percent(value) for value in (known.min(), known.max()))) if len(known) else ""


def _by_limit(rows: pd.DataFrame, names: list[str]) -> pd.DataFrame:
    """Return ``rows``' column "text", a row for each of ``names`` and a column for each limit that was asked for."""
    asked = rows.assign(asked=[limit(row) for _, row in rows.iterrows()])
    order = list(dict.fromkeys(asked[names].itertuples(index=False, name=None)))
    wide = asked.pivot(index=names, columns="asked", values="text").reindex(order)
    return wide[list(dict.fromkeys(asked["asked"]))].fillna("").rename_axis(columns=None).reset_index()


def motion(dynamic: pd.DataFrame) -> pd.DataFrame:
    """Return the least error of each model in each scene that moves, and how fast it runs then."""
    whole = dynamic[dynamic["failures"] == 0]
    best = whole.loc[whole.groupby(["scene", "model"], sort=False)["rmse_of_peak"].idxmin()]
    text = [f"{percent(row.rmse_of_peak)}, {_speed(row.real_time_factor)}" for row in best.itertuples()]
    wide = best.assign(text=text).pivot(index="scene", columns="model", values="text").fillna("")
    wide = wide.reindex(index=tables.scenes(dynamic), columns=list(dict.fromkeys(dynamic["model"])))
    return wide.rename(columns=lambda model: look(model).label).rename_axis(columns=None).reset_index()


def _speed(real_time_factor: float) -> str:
    """Return a speed in multiples of real time, with two significant digits and no exponent: "0.18 ×"."""
    return f"{float(f'{1 / real_time_factor:.2g}'):g} ×"


def effects(effects: pd.DataFrame) -> pd.DataFrame:
    """Return the time of a step of each scene, and the error without each of its effects."""
    rows = []
    for scene in tables.scenes(effects):
        found = tables.where(effects, scene=scene)
        left_out = found[found["error_if_left_out"].notna() & ~found["effect"].isin(BESIDES)]
        errors = [f"{row.effect} {percent(row.error_if_left_out)}" for row in left_out.itertuples()]
        elastic = found["effect"].iloc[0]
        rows.append([scene, elastic, seconds(1e-3 * found["ms_per_step"].sum()), ", ".join(errors)])
    return pd.DataFrame(rows, columns=["scene", "elastic effect", "a step", "error without …"])


def hard_cases(cases: pd.DataFrame) -> pd.DataFrame:
    """Return how often each outcome occurs in each family."""
    return pd.crosstab(cases["family"], cases["outcome"]).reset_index()


def scaling(scaling: pd.DataFrame) -> pd.DataFrame:
    """Return time and memory of a press with finite elements over the number of tetrahedra."""
    every = tables.where(scaling, component="fem")
    rows, most = tables.where(every, stage="respond"), every.groupby("size")["memory_mb"].max()
    memory = [f"{1e-3 * most[size]:.2g} GB" for size in rows["size"]]
    return pd.DataFrame({"tetrahedra": rows["size"], "a press": rows["seconds"].map(seconds), "memory": memory})
