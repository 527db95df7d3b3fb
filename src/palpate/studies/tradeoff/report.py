"""Compare models on pressed bodies: what to take, the truth, error against time, the models, when preparing pays."""

from collections.abc import Callable, Iterator
from html import escape

import pandas as pd

from palpate.benchmark.advice import NONE
from palpate.report import markup, tables
from palpate.report.material import Report, Section
from palpate.report.model_looks import label
from palpate.report.number_format import percent, seconds
from palpate.report.words import capital
from palpate.studies.tradeoff.advice_words import error_of, limit, sentence
from palpate.studies.tradeoff.figures.scene_rows import averaged, first_split, front_rows
from palpate.studies.tradeoff.figures.truth import DEAR, SOURCES
from palpate.studies.tradeoff.report_any_load import any_load
from palpate.studies.tradeoff.report_models import given_table, models_table, variants_table
from palpate.studies.tradeoff.report_numbers import hardest_of, numbers, pressed, scene_words
from palpate.studies.tradeoff.tables import TABLES

__all__ = ["TABLES", "TITLE", "failures", "numbers", "sections"]

TITLE = "What accuracy costs in time"
WHERE = {"rms": "over the surface (RMSE)", "patch": "at the patch"}
"""The kinds of error that advice is for, in words."""


def sections(report: Report) -> list[Section]:
    """Return what to take, the truth, the diagram of each scene, the models, and when preparing them pays."""
    settings, advice = report.tables["accuracy_vs_time"], pressed(report)
    names = {scene: scene_words(settings, scene) for scene in tables.scenes(settings)}
    hardest = hardest_of(settings)
    ordered = sorted(names, key=lambda scene: scene != hardest)
    taken = "".join(overview(tables.where(advice, error=kind), names, kind) for kind in WHERE)
    diagrams = report.note("work_precision")
    diagrams += "".join(_scene(report, scene, names[scene]) for scene in ordered)
    models = report.note("models") + models_table(report) + given_table(settings) + variants_table(settings)
    asked = "any_load" in report.tables
    paid = report.figure("break_even") + report.folded("accuracy_vs_time")
    return [
        (
            "advice_section",
            "What to take",
            taken + report.figure("advice") + _agreement(report) + report.folded("advice"),
        ),
        ("truth_section", "How well the truth is known", _truth(report, names)),
        ("error_bounds_section", "How wrong a single answer may be", _bounds(report, hardest)),
        ("diagrams", "Error against time, scene by scene", diagrams),
        *([("any_load_section", "Loads that nothing was prepared for", any_load(report))] if asked else []),
        ("models", "The models", models),
        ("break_even_section", "When preparing pays", paid),
    ]


def _truth(report: Report, names: dict[str, str]) -> str:
    """Show how well each scene's truth is known and, if the run has looked for them, the limit points of the law."""
    truth = report.tables["truth"]
    rows = pd.DataFrame(
        {
            "scene": [names.get(scene, scene) for scene in truth["scene"]],
            "samples": truth["samples"],
            "rejected": truth["rejected"],
            "elements": truth["elements"],
            "RMSE [% of peak]": 100 * truth["rmse_of_peak"],
            "relative L2 [%]": 100 * truth["relative_l2"],
            "at the patch [% of peak]": 100 * truth["patch_rms_of_peak"],
            "order": truth["order"],
            "samples with an inverted element": truth["inverted"],
            "change of volume [%]": 100 * truth["volume_change"],
        }
    )
    shown = report.figure("truth") + markup.table(rows, "The truth's own error, mean over the samples")
    if "limit_points" in report.tables:
        shown += report.figure("limit_points") + report.folded("limit_points")
    return shown + report.folded("truth")


def _bounds(report: Report, hardest: str) -> str:
    """Show the bounds of single answers in the scene ``hardest``: of each setting the sharpest cheap and dear ones."""
    found = tables.where(report.tables["error_bounds"], scene=hardest, error="rms").dropna(subset="sharpness")
    dear = found["estimate"].isin(DEAR).rename("dear")
    found = found.loc[found.groupby(["model", "setting", dear], sort=False)["sharpness"].idxmin()]
    least = found.groupby(["model", "setting"])["bound_of_peak"].transform("min")
    found = found.assign(least=least).sort_values(["least", "model", "setting", "estimate_s"])
    rows = pd.DataFrame(
        {
            "model": [label(row.model, row.setting) for row in found.itertuples()],
            "estimated from": [SOURCES.get(name, name) for name in found["estimate"]],
            "which takes [ms]": 1e3 * found["estimate_s"],
            "rank correlation": found["rank_correlation"],
            "error, median [% of peak]": 100 * found["error_of_peak"],
            "bound, median [% of peak]": 100 * found["bound_of_peak"],
            "bound over error": found["sharpness"],
            "answers below their bound [%]": 100 * found["coverage"],
            "contacts wholly below [%]": 100 * found["coverage_of_contacts"],
            "below bounds of other bodies [%]": 100 * found["coverage_elsewhere"],
        }
    )
    caption = (
        "90 % bounds of single answers' RMSE in the hardest scene, each from the sharpest estimate that costs next to "
        "nothing, and from the sharpest that costs a simulation"
    )
    return report.figure("error_bounds") + markup.table(rows, caption) + report.folded("error_bounds")


def _agreement(report: Report) -> str:
    """Show how often the splits advise the same, and how advice changes with the finger, where the run has that."""
    shown = ""
    if "advice_agreement" in report.tables:
        shown += report.note("advice_agreement") + report.folded("advice_agreement")
    if "advice_by_radius" in report.tables:
        shown += report.figure("advice_flips") + report.folded("advice_by_radius")
    return shown


def _scene(report: Report, scene: str, title: str) -> str:
    """Show the diagram of a scene; folded, its advice in sentences and what is on the front."""
    front = front_rows(averaged(tables.where(report.tables["accuracy_vs_time"], scene=scene)))
    rows = pd.DataFrame(
        {
            "model": [label(row.model, row.setting) for row in front.itertuples()],
            "RMSE [% of peak]": 100 * front["rmse_of_peak"],
            "relative L2 [%]": 100 * front["relative_l2"],
            "at the patch [% of peak]": 100 * front["patch_rms_of_peak"],
            "p95 of the nodes [% of peak]": 100 * front["p95_of_peak"],
            "online, median [ms]": 1e3 * front["online_median_s"],
            "online, p95 [ms]": 1e3 * front["online_p95_s"],
            "preparation [s]": front["offline_s"],
            "memory [MB]": front["memory_mb"],
            "answers until it has paid": front["break_even_queries"],
        }
    )
    advice = first_split(tables.where(report.tables["advice"], scene=scene))
    inside = "".join(f"<p>Errors {text}:</p>{items(tables.where(advice, error=kind))}" for kind, text in WHERE.items())
    inside += markup.table(rows, "The front that lasts from run to run, fastest first")
    return report.picture(f"work_precision_{scene}", capital(title), small=f"best_models_{scene}") + markup.fold(
        f"{capital(title)}: the advice in words, and the models on the front", inside
    )


def items(advice: pd.DataFrame, said: Callable[[pd.Series], str] = sentence) -> str:
    """List advice, each row as ``said`` puts it."""
    return f"<ul>{''.join(f'<li>{escape(said(row))}</li>' for _, row in advice.iterrows())}</ul>"


def overview(advice: pd.DataFrame, names: dict[str, str], kind: str) -> str:
    """Tabulate what to take for the least error of ``kind``, one of WHERE, its error and its time."""
    first = first_split(advice)
    caption = f"What to take for the least error {WHERE[kind]}, that error, and the time at the 95th percentile"
    if len(first) < len(advice):
        caption += "; in brackets, the number of splits that advise the same model, if not all do"
    return by_limit(advice, names, caption, lambda row: _taken(row) + _in_splits(row, advice))


def by_limit(advice: pd.DataFrame, names: dict[str, str], caption: str, said: Callable[[pd.Series], str]) -> str:
    """Tabulate advice: a row for each scene of ``names``, a column for each limit, cells as ``said`` puts them."""
    if advice.empty:
        return ""
    first = first_split(advice)
    wide = first.assign(taken=[said(row) for _, row in first.iterrows()], limit=_limits(first))
    wide = wide.pivot(index="scene", columns="limit", values="taken")
    wide = wide.reindex(index=list(names), columns=pd.unique(_limits(advice))).rename(index=names)
    return markup.table(wide.reset_index(), caption)


def _limits(advice: pd.DataFrame) -> pd.Series:
    return pd.Series([limit(row) for _, row in advice.iterrows()], index=advice.index, dtype=object)


def _taken(row: pd.Series) -> str:
    """Name what is advised, without its setting, for which there is no room."""
    if row["model"] == NONE:
        return "none"
    return f"{label(row['model'], 'default')}: {percent(error_of(row))} in {seconds(row['online_p95_s'])}"


def _in_splits(row: pd.Series, advice: pd.DataFrame) -> str:
    """Count the splits in which the same model is advised for one question, unless that is all of them."""
    asked = tables.where(advice, scene=row["scene"])
    asked = asked[_limits(asked) == limit(row)]
    same = int((asked["model"] == row["model"]).sum())
    return f" ({same} of {len(asked)} splits)" if same < len(asked) else ""


def failures(report: Report) -> Iterator[tuple[str, str, str]]:
    """Yield the settings that failed on some test samples, or on all: what, where, how."""
    table = report.tables["accuracy_vs_time"]
    for row in table[table["failures"] > 0].itertuples():
        reason = "" if pd.isna(row.failure) else f": {row.failure}"
        where = scene_words(table, row.scene)
        yield label(row.model, row.setting), where, f"{row.failures} of {row.samples} test samples{reason}"
