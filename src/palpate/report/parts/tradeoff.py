"""Compare models on pressed bodies: what to take, error against time, the models, and when preparing pays."""

from collections.abc import Iterator
from html import escape

import pandas as pd

from palpate.evaluation.tradeoff.advice import NONE
from palpate.evaluation.tradeoff.advice_reasons import MARGIN, mesh_error
from palpate.evaluation.tradeoff.bootstrap import TRUTH
from palpate.evaluation.tradeoff.equal_settings import CLOSE, EQUAL
from palpate.evaluation.tradeoff.tables import TABLES
from palpate.figures import tables
from palpate.figures.model_looks import label
from palpate.figures.number_format import percent, seconds
from palpate.figures.tradeoff.work_precision import front_rows
from palpate.models.model_registry import SAVED_AGAINST
from palpate.report import markup
from palpate.report.advice_answer import answer
from palpate.report.advice_words import limit, sentence
from palpate.report.material import Report, Section
from palpate.report.words import capital, named, spaced

__all__ = ["TABLES", "TITLE", "failures", "numbers", "sections"]

TITLE = "What accuracy costs in time"
_OWN = {"what": "a model of your own", "before": "–", "setting": "–"}


def numbers(report: Report) -> dict[str, str]:
    """Return every placeholder of these captions, as text; ``answer`` and ``picture`` are for the top of the page."""
    settings, advice = report.tables["accuracy_vs_time"], _pressed(report)
    models = settings[settings["model"] != TRUTH]
    hardest = _hardest(settings)
    advised, measured = (tables.where(table, scene=hardest) for table in (advice, settings))
    what = {name: family["short"] for family in report.entries("models") for name in family["names"]}
    return {
        "headline": _headline(advice),
        "answer": "\n".join([_situation(settings, hardest), *answer(advised, measured, what)]),
        "picture": f"best_models_{hardest}",
        "hardest": _words(settings, hardest),
        "tradeoff_models": str(models["model"].nunique()),
        "tradeoff_settings": f"{len(models):,}",
        "tradeoff_failures": _failed(models),
        "tradeoff_truth": _truth(settings),
        "close": f"{CLOSE:g}",
        "equal": f"{EQUAL:g}",
        "spare": percent(MARGIN),
    }


def _pressed(report: Report) -> pd.DataFrame:
    """Return the advice for bodies that are pressed; scenes that move have a part of their own."""
    advice = report.tables["advice"]
    return advice[advice["scene"].isin(report.tables["accuracy_vs_time"]["scene"])]


def _words(settings: pd.DataFrame, scene: str) -> str:
    """Name a scene: "liver, large loads"."""
    row = tables.where(settings, scene=scene).iloc[0]
    return f"{spaced(row['body'])}, {spaced(row['regime'])} loads"


def _fine(settings: pd.DataFrame) -> pd.Series:
    """Return the time [s] of a converged answer of the fine simulation, by scene."""
    return tables.where(settings, model=SAVED_AGAINST).groupby("scene", sort=False)["online_median_s"].last()


def _hardest(settings: pd.DataFrame) -> str:
    """Name the scene in which the fine simulation takes longest."""
    return str(_fine(settings).idxmax())


def _situation(settings: pd.DataFrame, scene: str) -> str:
    """Begin the answer: which scene it is about, and what the fine simulation takes there."""
    row = tables.where(settings, scene=scene).iloc[0]
    return (
        f"The hardest scene of this run is the {spaced(row['body'])} under {spaced(row['regime'])} loads: one answer "
        f"of the fine simulation takes {seconds(_fine(settings)[scene])}."
    )


def _headline(advice: pd.DataFrame) -> str:
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
    low, high = percent(rows["rmse_of_peak"].min()), percent(rows["rmse_of_peak"].max())
    errors = f"error {low}" if low == high else f"error {low} to {high}"
    return f"{label(model, 'default')} in {len(rows)} of {scenes} scenes ({errors})"


def _failed(models: pd.DataFrame) -> str:
    count = int((models["failures"] > 0).sum())
    return f"{count} failed on at least one sample; they are named below their diagram" if count else "none failed"


def _truth(settings: pd.DataFrame) -> str:
    """Return the error of the fine mesh itself, a phrase for each scene."""
    own = {scene: mesh_error(tables.where(settings, scene=scene)) for scene in tables.scenes(settings)}
    known = [f"{percent(error)} ({_words(settings, scene)})" for scene, error in own.items() if error == error]
    return "; ".join(known) or "not measured"


def sections(report: Report) -> list[Section]:
    """Return what to take, the diagram of each scene, the models, and when preparing them pays."""
    settings, advice = report.tables["accuracy_vs_time"], _pressed(report)
    names = {scene: _words(settings, scene) for scene in tables.scenes(settings)}
    hardest = _hardest(settings)
    ordered = sorted(names, key=lambda scene: scene != hardest)
    taken = overview(advice, names) + report.figure("advice") + report.folded("advice")
    diagrams = report.note("work_precision") + "".join(_scene(report, scene, names[scene]) for scene in ordered)
    paid = report.figure("break_even") + report.folded("accuracy_vs_time")
    return [
        ("advice_section", "What to take", taken),
        ("diagrams", "Error against time, scene by scene", diagrams),
        ("models", "The models", report.note("models") + _models(report)),
        ("break_even_section", "When preparing pays", paid),
    ]


def _scene(report: Report, scene: str, title: str) -> str:
    """Show the diagram of a scene; folded, its advice in sentences and what is on the front."""
    front = front_rows(tables.where(report.tables["accuracy_vs_time"], scene=scene))
    rows = pd.DataFrame(
        {
            "model": [label(row.model, row.setting) for row in front.itertuples()],
            "RMSE [% of peak]": 100 * front["rmse_of_peak"],
            "p95 of the nodes [% of peak]": 100 * front["p95_of_peak"],
            "online, median [ms]": 1e3 * front["online_median_s"],
            "online, p95 [ms]": 1e3 * front["online_p95_s"],
            "preparation [s]": front["offline_s"],
            "memory [MB]": front["memory_mb"],
            "answers until it has paid": front["break_even_queries"],
        }
    )
    inside = items(tables.where(report.tables["advice"], scene=scene))
    inside += markup.table(rows, "The front that lasts from run to run, fastest first")
    return report.picture(f"work_precision_{scene}", capital(title), small=f"best_models_{scene}") + markup.fold(
        f"{capital(title)}: the advice in words, and the models on the front", inside
    )


def items(advice: pd.DataFrame) -> str:
    """List advice in sentences."""
    return f"<ul>{''.join(f'<li>{escape(sentence(row))}</li>' for _, row in advice.iterrows())}</ul>"


def overview(advice: pd.DataFrame, names: dict[str, str]) -> str:
    """Tabulate advice: a row for each limit, a column for each scene of ``names``; what to take, its error and time."""
    advice = advice.assign(limit=[limit(row) for _, row in advice.iterrows()])
    wide = advice.assign(taken=[_taken(row) for _, row in advice.iterrows()])
    wide = wide.pivot(index="limit", columns="scene", values="taken")
    wide = wide.reindex(index=advice["limit"].unique(), columns=list(names)).rename(columns=names)
    return markup.table(wide.reset_index(), "What to take, its error, and its time at the 95th percentile")


def _taken(row: pd.Series) -> str:
    if row["model"] == NONE:
        return "none"
    return f"{label(row['model'], row['setting'])}: {percent(row['rmse_of_peak'])} in {seconds(row['online_p95_s'])}"


def _models(report: Report) -> str:
    """Describe the models that were measured: a row for each family, and for each model of the user's own."""
    measured = report.tables["accuracy_vs_time"].groupby("model", sort=False)["setting"].nunique()
    rows, known = [], set()
    for family in report.entries("models"):
        names = [name for name in family["names"] if name in measured]
        known.update(names)
        if names:
            rows.append(_family(family["family"], family, measured[names]))
    rows += [_family(named(name), _OWN, measured[[name]]) for name in measured.index if name not in known]
    return markup.table(pd.DataFrame(rows), "Models and their settings, as measured in all scenes together")


def _family(name: str, words: dict, settings: pd.Series) -> dict:
    """Describe one family; of several models the most settings."""
    return {
        "model": name,
        "what it does": words["what"],
        "preparation": words["before"],
        "setting": words["setting"],
        "variants": len(settings),
        "settings of each": int(settings.max()),
    }


def failures(report: Report) -> Iterator[tuple[str, str, str]]:
    """Yield the settings that failed on some test samples, or on all: what, where, how."""
    table = report.tables["accuracy_vs_time"]
    for row in table[table["failures"] > 0].itertuples():
        reason = "" if pd.isna(row.failure) else f": {row.failure}"
        where = _words(table, row.scene)
        yield label(row.model, row.setting), where, f"{row.failures} of {row.samples} test samples{reason}"
