"""Describe the models of the trade-off, what each is given, and what that is worth."""

import pandas as pd

from palpate.models.model_registry import ENGINES, FAMILY_OF, INSTALL
from palpate.report import markup, tables
from palpate.report.material import Report
from palpate.report.model_looks import label
from palpate.report.names import named
from palpate.report.number_format import percent
from palpate.report.words import spaced
from palpate.studies.tradeoff.figures.scene_rows import answers, averaged, curves

_OWN = {"what": "a model of your own", "before": "–", "setting": "–"}
_GIVEN = {
    ("load", True): "the load, at a contact that was prepared",
    ("load", False): "the load",
    ("deformation", True): "a coarse deformation, at a contact that was prepared",
    ("deformation", False): "a coarse deformation only",
}
"""In words, what a model is given: the columns ``sees`` and ``prepared``."""


def models_table(report: Report) -> str:
    """Describe the models that were measured: a row for each family, and for each model of the user's own."""
    measured = answers(report.tables["accuracy_vs_time"]).groupby("model", sort=False)["setting"].nunique()
    rows, known = [], set()
    for family in report.entries("models"):
        names = [name for name in family["names"] if name in measured]
        known.update(names)
        if names:
            rows.append(_family(family["family"], family, measured[names]))
    rows += [_family(named(name), _OWN, measured[[name]]) for name in measured.index if name not in known]
    shown = markup.table(pd.DataFrame(rows), "Models and their settings, as measured in all scenes together")
    missing = [label(name, "default") for name in ENGINES if name not in measured]
    return shown + (f"<p>Not measured here: {', '.join(missing)}; {markup.escaped(INSTALL)}.</p>" if missing else "")


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


def given_table(settings: pd.DataFrame) -> str:
    """Tabulate what models are given: their names, and the least error of any of them in any time, over the scenes."""
    rows = []
    for (sees, prepared), found in answers(settings).groupby(["sees", "prepared"], sort=False):
        models = [label(name, "default") for name in curves(found)]
        least = found[found["failures"] == 0].groupby(["scene", "split"])[["rmse_of_peak", "patch_rms_of_peak"]].min()
        rows.append(
            {
                "is given": _GIVEN[sees, bool(prepared)],
                "models": ", ".join(models),
                "least RMSE": _range(least["rmse_of_peak"]),
                "least error at the patch": _range(least["patch_rms_of_peak"]),
            }
        )
    return markup.table(
        pd.DataFrame(rows),
        "What models are given, and the least error on test samples with it in any time, of settings chosen by it, "
        "over the scenes",
    )


def _range(values: pd.Series) -> str:
    if values.empty:
        return "–"
    low, high = percent(values.min()), percent(values.max())
    return low if low == high else f"{low} to {high}"


def variants_table(settings: pd.DataFrame) -> str:
    """Tabulate the variants that share a curve in the diagrams: the least error of each."""
    whole = settings[settings["model"].isin(FAMILY_OF) & (settings["failures"] == 0)]
    if whole.empty:
        return ""
    wide = pd.concat([averaged(tables.where(whole, scene=scene)) for scene in tables.scenes(whole)])
    wide = wide.pivot_table("rmse_of_peak", "model", "scene", aggfunc="min", sort=False)
    wide = wide.map(percent).rename(index=named, columns=spaced).rename_axis("variant").rename_axis(None, axis=1)
    return markup.table(
        wide.reset_index(),
        "Least RMSE of each variant of models that share a curve, of settings chosen by their errors on test samples",
    )
