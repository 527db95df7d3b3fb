"""Work out the numbers that the captions and the headline about the trade-off name, from its tables."""

from collections import Counter

import pandas as pd

from palpate.benchmark.advice import MARGIN, NONE
from palpate.benchmark.comparison import CLOSE, EQUAL, KINDS
from palpate.models.model_registry import FAMILY_OF, SAVED_AGAINST
from palpate.report import tables
from palpate.report.material import Report
from palpate.report.model_looks import label
from palpate.report.number_format import percent, seconds
from palpate.report.words import capital, listed, spaced
from palpate.studies.tradeoff.advice_answer import answer
from palpate.studies.tradeoff.advice_words import agreement_words
from palpate.studies.tradeoff.figures.scene_rows import KNOWN, answers, averaged, first_split
from palpate.studies.tradeoff.limit_points import jumps


def numbers(report: Report) -> dict[str, str]:
    """Return every placeholder of these captions, as text; ``answer`` and ``picture`` are for the top of the page."""
    settings, truth = report.tables["accuracy_vs_time"], report.tables["truth"]
    advice = first_split(pressed(report))
    models = answers(settings)
    hardest = hardest_of(settings)
    advised, measured = (tables.where(table, scene=hardest) for table in (advice, settings))
    what = {name: family["short"] for family in report.entries("models") for name in family["names"]}
    told = answer(advised, measured, what)
    known = tables.where(truth, scene=hardest)
    return {
        "headline": headline(tables.where(advice, error="rms")),
        "answer": "\n".join([situation(settings, hardest), *told, *at_the_finger(advised), *exactness(known)]),
        "picture": f"best_models_{hardest}",
        "hardest": scene_words(settings, hardest),
        "tradeoff_models": counted(models),
        "tradeoff_settings": f"{models.groupby(['model', 'setting']).ngroups:,}",
        "tradeoff_failures": _failed(models),
        "tradeoff_truth": _known(truth),
        "tradeoff_samples": _few(truth["samples"]),
        "tradeoff_less_known": _validation(truth),
        "tradeoff_checked": _checked(truth),
        "tradeoff_agreed": agreement_words(report.tables["advice_agreement"])
        if "advice_agreement" in report.tables
        else "",
        "limit_snaps": snaps(report.tables["limit_points"]) if "limit_points" in report.tables else "",
        "tradeoff_splits": _splits(settings),
        "bound_contacts": _few(report.tables["error_bounds"]["contacts"]),
        "known": percent(KNOWN),
        "close": f"{CLOSE:g}",
        "equal": f"{EQUAL:g}",
        "spare": percent(MARGIN),
    }


def pressed(report: Report) -> pd.DataFrame:
    """Return the advice for bodies that are pressed; scenes that move have a part of their own."""
    advice = report.tables["advice"]
    return advice[advice["scene"].isin(report.tables["accuracy_vs_time"]["scene"])]


def scene_words(settings: pd.DataFrame, scene: str) -> str:
    """Name a scene: "liver, large loads"."""
    row = tables.where(settings, scene=scene).iloc[0]
    return f"{spaced(row['body'])}, {spaced(row['regime'])} loads"


def _fine(settings: pd.DataFrame) -> pd.Series:
    """Return the time [s] of a converged answer of the model that prepares nothing, by scene."""
    return tables.where(settings, model=SAVED_AGAINST).groupby("scene", sort=False)["online_median_s"].last()


def hardest_of(settings: pd.DataFrame) -> str:
    """Name the scene in which a simulation on the finest mesh takes longest."""
    return str(_fine(settings).idxmax())


def situation(settings: pd.DataFrame, scene: str) -> str:
    """Begin the answer: which scene it is about, and what a simulation on the finest mesh takes there."""
    row = tables.where(settings, scene=scene).iloc[0]
    return (
        f"The hardest scene of this run is the {spaced(row['body'])} under {spaced(row['regime'])} loads: one answer "
        f"of {label(SAVED_AGAINST, 'default')} on its finest mesh takes {seconds(_fine(settings)[scene])}."
    )


def exactness(truth: pd.DataFrame) -> list[str]:
    """Put into a sentence how well the truth of a scene is known, over the surface and at the patch."""
    return [
        f"The truth itself is known to {percent(row.rmse_of_peak)} of the peak displacement over the surface, and to "
        f"{percent(row.patch_rms_of_peak)} in the dent under the disc of {1e3 * row.radius_m:g} mm radius"
        f"{_less_known(row)}."
        for row in truth.itertuples()
    ]


def _less_known(row) -> str:
    """Explain how well the truth is known on validation samples, where these do without its finest mesh."""
    if not row.validation_samples:
        return ""
    over, patch = percent(row.validation_rmse_of_peak), percent(row.validation_patch_rms_of_peak)
    return f" ({over} and {patch} where settings are chosen)"


def snaps(limit_points: pd.DataFrame) -> str:
    """Put into a sentence how many contacts snap, and which of them first."""
    found = jumps(limit_points)
    count, every = (len(table.groupby(["body", "contact"])) for table in (found, limit_points))
    if found.empty:
        return f"At none of {every} contacts the dent grows much faster than the load."
    first = found.loc[found["pressure_of_young_after"].idxmin()]
    pressures = f"{first['pressure_of_young_before']:g} and {first['pressure_of_young_after']:g} of Young's modulus"
    grown = f"from {percent(first['peak_of_size_before'])} of the body's size"
    if first["peak_of_size_after"] > 0:
        grown += f" to {percent(first['peak_of_size_after'])}"
    return f"At {count} of {every} contacts the dent snaps, first between {pressures}, {grown}."


def at_the_finger(advice: pd.DataFrame) -> list[str]:
    """Put into a sentence the error at the patch of what is advised within each budget, for the scene of ``advice``."""
    found = tables.where(advice, error="patch").dropna(subset="budget_ms")
    found = found[found["model"] != NONE]
    parts = [
        f"{percent(row['patch_rms_of_peak'])} within {row['budget_ms']:g}\u00a0ms ({label(row['model'], 'default')})"
        for _, row in found.drop_duplicates(subset=["model", "setting"]).iterrows()
    ]
    return [f"In the dent itself, the advised model has {listed(parts)}."] if parts else []


def headline(advice: pd.DataFrame) -> str:
    """Name what is advised within each budget, and its error, over the scenes."""
    parts = []
    for budget, rows in advice.groupby("budget_ms"):
        models = ", ".join(_share(model, found, len(rows)) for model, found in rows.groupby("model", sort=False))
        parts.append(f"within {budget:g}\u00a0ms, {models}")
    return f"{capital('; '.join(parts))}." if parts else "No budget of time was asked about."


def _share(model: str, rows: pd.DataFrame, scenes: int) -> str:
    """Name one model's part of the scenes, and its errors there."""
    if model == NONE:
        return f"no model in {len(rows)} of {scenes} scenes"
    return f"{label(model, 'default')} in {len(rows)} of {scenes} scenes (error {_range(rows['rmse_of_peak'])})"


def counted(models: pd.DataFrame) -> str:
    """Count the models, of which variants of one method are one: "13 methods (one in 12 variants, one in 4)"."""
    counts = Counter(FAMILY_OF.get(name, name) for name in models["model"].unique())
    several = [f"one in {count} variants" for count in counts.values() if count > 1]
    return f"{len(counts)} methods" + (f" ({', '.join(several)})" if several else "")


def _failed(models: pd.DataFrame) -> str:
    count = int((models["failures"] > 0).sum())
    return f"{count} failed on at least one sample; they are named below their diagram" if count else "none failed"


def _known(truth: pd.DataFrame) -> str:
    """Return how well the truth is known over the surface and at the patch: the ranges over the scenes."""
    ranges = [_range(truth[column]) for column in KINDS.values()]
    return "{} over the surface and {} at the patch".format(*ranges)


def _range(errors: pd.Series) -> str:
    low, high = percent(errors.min()), percent(errors.max())
    return low if low == high else f"{low} to {high}"


def _validation(truth: pd.DataFrame) -> str:
    """Explain how well the truth is known on samples that only choose settings, if these do without the finest mesh."""
    less = truth[truth["validation_samples"] > 0]
    if less.empty:
        return "Samples that choose settings have the same meshes."
    over, patch = (_range(less[f"validation_{column}"]) for column in KINDS.values())
    return (
        f"Samples that only choose settings may have one mesh less, and a larger error (crosses): {over} over the "
        f"surface and {patch} at the patch, below which models are tied, too."
    )


def _checked(truth: pd.DataFrame) -> str:
    """Return on how many samples another element was tried."""
    counts = truth["other_element_samples"].dropna().astype(int) if "other_element_samples" in truth else []
    if not len(counts):
        return "no sample"
    return "one sample a scene" if set(counts) == {1} else f"{_few(counts)} samples a scene"


def _few(counts: pd.Series) -> str:
    least, most = counts.min(), counts.max()
    return f"{least}" if least == most else f"{least} to {most}"


def _splits(settings: pd.DataFrame) -> str:
    """Describe what was held out, and how often."""
    count = settings["split"].nunique()
    if count == 1:
        return "one division of the contacts into training, validation and test contacts"
    spread = [averaged(answers(tables.where(settings, scene=scene))) for scene in tables.scenes(settings)]
    ratio = pd.concat([rows["rmse_of_peak_high"] / rows["rmse_of_peak_low"].clip(lower=1e-9) for rows in spread])
    return (
        f"{count} divisions of the contacts into training, validation and test contacts, between which the error of "
        f"a setting changes by a factor of {ratio.median():.2g} (median)"
    )
