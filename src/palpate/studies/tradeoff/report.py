"""Compare models on pressed bodies: what to take, the truth, error against time, the models, when preparing pays."""

from collections import Counter
from functools import partial
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from palpate.benchmark.advice import choice, operator_error, other_loads
from palpate.benchmark.choosing import MARGIN, NONE, TIED, Limit
from palpate.benchmark.ranking import EQUAL, KINDS, TIED_TIMES, UNKNOWN, averaged, own_error
from palpate.files import read_yaml
from palpate.models.model_registry import FAMILY_OF, SAVED_AGAINST
from palpate.report import tables
from palpate.report.advice_words import SAME, by_limit, say
from palpate.report.model_looks import label, named
from palpate.report.report import Report
from palpate.report.words import listed, percent, spaced, span
from palpate.studies.tradeoff.figures.scene_rows import KNOWN, answers, curves, front_rows, jumps, whole
from palpate.studies.tradeoff.figures.truth import DEAR, SOURCES

READS = ("accuracy_vs_time", "advice", "answers")
"""Tables of benchmark/ that the template shows."""
WHERE = {"rms": "over the surface (RMSE)", "patch": "at the patch"}
"""The kinds of error that advice is for, in words."""
LIMITS = (0.05, 0.01)
"""Largest errors [of the peak] that kinds of load are asked for."""
MEANINGS = {
    1.0: "fast enough for force feedback to a hand",
    16.7: "one picture at 60 a second",
    100.0: "still felt as immediate",
}
"""What a budget [ms] is for."""
_OWN = {"what": "a model of your own", "before": "–", "setting": "–"}
_GIVEN = {
    ("load", True): "the load, at a contact that was prepared",
    ("load", False): "the load",
    ("deformation", True): "a coarse deformation, at a contact that was prepared",
    ("deformation", False): "a coarse deformation only",
}
"""In words, what a model is given: the columns ``sees`` and ``prepared``."""


def numbers(report: Report) -> dict[str, Any]:
    """Return what the template names."""
    settings, truth = report.tables["accuracy_vs_time"], report.tables["truth"]
    optional, advice = report.tables, report.tables["advice"]
    advice = advice[advice["scene"].isin(settings["scene"])]  # scenes that move have a part of their own
    take = partial(say, "taken", setting=False)
    models = answers(settings)
    names = {scene: scene_words(settings, scene) for scene in tables.scenes(settings)}
    hardest = hardest_of(settings)
    families: Any = read_yaml(Path(__file__).with_name("models.yaml"))
    short_words = {name: family["short"] for family in families for name in family["names"]}
    return {
        "budgets": budgets(tables.where(advice, error="rms")),
        "answer_of": answer(tables.where(advice, scene=hardest), short_words),
        "hardest": {"scene": hardest, "words": names[hardest]} | _situation(settings, hardest),
        "known_there": _known(tables.where(settings, scene=hardest), tables.where(truth, scene=hardest)),
        "tied": TIED,
        "unknown": UNKNOWN,
        "models": counted(models),
        "settings": models.groupby(["model", "setting"]).ngroups,
        "failed": int((models["failures"] > 0).sum()),
        "truth_errors": [_own_range(truth, column) for column in KINDS.values()],
        "less_known": _validation(truth),
        "spread": _spread(settings),
        "known": KNOWN,
        "close": TIED_TIMES,
        "equal": EQUAL,
        "spare": MARGIN,
        "taken": {text: by_limit(tables.where(advice, error=kind), names, take) for kind, text in WHERE.items()},
        "dent": dent_table(tables.where(advice, error="rms"), truth, names),
        "names": names,
        "snaps": snaps(optional["limit_points"]) if "limit_points" in optional else None,
        "bounds": _bounds(report.tables["error_bounds"], hardest),
        "scenes": [
            {
                "scene": scene,
                "words": names[scene],
                "facets": facets(tables.where(truth, scene=scene)),
                "front": _front(tables.where(settings, scene=scene)),
            }
            for scene in sorted(names, key=lambda scene: scene != hardest)
        ],
        "any_load": _any_load(optional["any_load"], settings) if "any_load" in optional else None,
        "refusals": _refusals(optional["any_load"]) if "any_load" in optional else None,
        "described": models_table(models, families),
        "given": given_table(settings),
        "variants": variants_table(settings),
    }


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


def _situation(settings: pd.DataFrame, scene: str) -> dict[str, Any]:
    """Return the body and the regime of a scene, and what a simulation on the finest mesh takes there."""
    row = tables.where(settings, scene=scene).iloc[0]
    fine = {"model": label(SAVED_AGAINST, "default"), "seconds": _fine(settings)[scene]}
    return {"body": spaced(row["body"]), "regime": spaced(row["regime"])} | fine


def budgets(advice: pd.DataFrame) -> list[dict[str, Any]]:
    """Return the models that are advised within each budget, in how many scenes, and the range of their errors."""
    rows_of_budgets = []
    for budget, rows in advice.groupby("budget_ms"):
        models = [
            {
                "name": "no model" if model == NONE else label(str(model), "default"),
                "scenes": len(part),
                "error": "" if model == NONE else span(part["rmse_of_peak"]),
            }
            for model, part in rows.groupby("model", sort=False)
        ]
        rows_of_budgets.append({"ms": f"{budget:g}", "scenes": len(rows), "models": models})
    return rows_of_budgets


def answer(advice: pd.DataFrame, what: dict[str, str]) -> dict[str, Any]:
    """Return what the first screen says of one scene, of which these are the rows.

    what : a few words on what each model does
    """
    rows = [row for _, row in tables.where(advice, error="rms").iterrows()]
    timed, by_error = ([row for row in rows if np.isfinite(row["budget_ms"]) == is_timed] for is_timed in (True, False))
    at_finger = tables.where(advice, error="patch").dropna(subset="budget_ms")
    at_finger = at_finger[at_finger["model"] != NONE].drop_duplicates(subset=["model", "setting"])
    return {
        "within": [_answer(same) | _within(same, what) for same in _alike(timed)],
        "under": [_answer(same) | _under(same) for same in _alike(by_error)],
        "dent": [
            f"{percent(row['patch_rms_of_peak'])} within {row['budget_ms']:g}\u00a0ms "
            f"({label(row['model'], 'default')}{_below(row)})"
            for _, row in at_finger.iterrows()
        ],
    }


def _below(row: pd.Series) -> str:
    return f"; nine in ten below {percent(row['bound_of_peak'])}" if row["bound_of_peak"] > 0 else ""


def _alike(rows: list[pd.Series]) -> list[list[pd.Series]]:
    """Group neighbouring rows of advice.csv that advise the same; errors that nothing keeps are told one by one."""
    return [
        list(same)
        for _, same in groupby(
            rows, lambda row: (row["model"], row["setting"], row["model"] == NONE and row["max_error"])
        )
    ]


def _answer(rows: list[pd.Series]) -> dict[str, Any]:
    """Return what rows of advice.csv share: the model, its error, its times and what it rests on; none is empty."""
    first = rows[0]
    if first["model"] == NONE:
        return {"model": "", "nearest": say("nearest", first, setting=False), "why": first["why"]}
    return {"model": label(first["model"], "default"), "cell": say("cell", first)}


def _within(rows: list[pd.Series], what: dict[str, str]) -> dict[str, Any]:
    first = rows[0]
    given = [(row["budget_ms"], MEANINGS.get(row["budget_ms"])) for row in rows]
    budgets = listed([f"{budget:g}\u00a0ms{f' ({meaning})' if meaning else ''}" for budget, meaning in given])
    return {"budgets": budgets, "what": what.get(first["model"], ""), "next": say("nextbest", first)}


def _under(rows: list[pd.Series]) -> dict[str, Any]:
    """Return the limits of the error, and of what is advised what exceeds them."""
    beware = next(filter(None, (say("exceeded", row) for row in rows)), "")
    return {"limits": listed([percent(row["max_error"]) for row in rows]), "beware": beware}


def snaps(limit_points: pd.DataFrame) -> dict[str, Any]:
    """Return how many contacts snap, and which of them first."""
    snapping = jumps(limit_points)
    n_snapping, n_contacts = (len(table.groupby(["body", "contact"])) for table in (snapping, limit_points))
    first_snap = snapping.loc[snapping["pressure_of_young_after"].idxmin()].to_dict() if len(snapping) else {}
    return {"count": n_snapping, "every": n_contacts, "first": first_snap}


def counted(models: pd.DataFrame) -> str:
    """Count the models, of which variants of one method are one: "13 methods (one in 12 variants, one in 4)"."""
    counts = Counter(FAMILY_OF.get(name, name) for name in models["model"].unique())
    several = [f"one in {count} variants" for count in counts.values() if count > 1]
    return f"{len(counts)} methods" + (f" ({', '.join(several)})" if several else "")


def _validation(truth: pd.DataFrame) -> list[str]:
    """Return the truth's errors on samples that only choose settings, if these do without the finest mesh."""
    less = truth[truth["validation_samples"] > 0]
    return [] if less.empty else [_own_range(less, f"validation_{column}") for column in KINDS.values()]


def _own_range(truth: pd.DataFrame, column: str) -> str:
    """Return between which the truth's mean own errors lie in the scenes, and the greatest of a sample."""
    greatest = truth[f"{column}_max"].max()
    return span(truth[column]) + (f" (at most {percent(greatest)})" if np.isfinite(greatest) else "")


def _known(settings: pd.DataFrame, truth: pd.DataFrame) -> list[tuple[float, float]]:
    """Return for each kind of error the truth's own in one scene: the mean, as ``own_error``, and the greatest."""
    greatest = [truth[[f"{column}_max", f"validation_{column}_max"]].max(axis=None) for column in KINDS.values()]
    return list(zip((own_error(settings, column) for column in KINDS.values()), greatest, strict=True))


def _spread(settings: pd.DataFrame) -> float:
    """Return the median factor by which the error of a setting changes between splits."""
    scenes = [averaged(answers(tables.where(settings, scene=scene))) for scene in tables.scenes(settings)]
    return pd.concat(rows["rmse_of_peak_high"] / rows["rmse_of_peak_low"].clip(lower=1e-9) for rows in scenes).median()


def dent_table(advice: pd.DataFrame, truth: pd.DataFrame, names: dict[str, str]) -> pd.DataFrame:
    """Tabulate by which factor the errors of advised models are larger in the dent than over the surface.

    advice : rows that advise by the error over the surface. A row a scene with its finger, and one for all scenes.
    """
    taken = advice[advice["model"] != NONE].drop_duplicates(["scene", "model", "setting"])
    factor = (taken["patch_rms_of_peak"] / taken["rmse_of_peak"]).groupby(taken["scene"], sort=False)
    radius = truth.set_index("scene")["radius_m"]
    ratios_of = {names[scene]: (f"{1e3 * radius[scene]:g}", ratios) for scene, ratios in factor}
    ratios_of["all of these"] = ("", taken["patch_rms_of_peak"] / taken["rmse_of_peak"])
    return pd.DataFrame(
        [
            {"scene": scene, "radius of the finger [mm]": mm, "settings": len(ratios), "least factor": ratios.min()}
            | {"median factor": ratios.median(), "largest factor": ratios.max()}
            for scene, (mm, ratios) in ratios_of.items()
            if len(ratios)
        ]
    )


def facets(truth: pd.DataFrame) -> str:
    """Say what the facets of one scene's body change, which no error against its truth contains."""
    changes = truth.reindex(columns=["geometry_of_peak", "geometry_patch_of_peak"]).dropna()
    if changes.empty:
        return "Not in these errors: what the flat facets of the surface change, which is not known."
    surface, patch = changes.iloc[0]
    return (
        f"Not in these errors: flat facets in the place of the smooth shape change {percent(surface)} over the surface "
        f"and {percent(patch)} at the patch."
    )


def _bounds(bounds: pd.DataFrame, hardest: str) -> pd.DataFrame:
    """Select the bounds of single answers in one scene: of each setting the sharpest cheap and dear ones."""
    of_scene = tables.where(bounds, scene=hardest, error="rms").dropna(subset="sharpness")
    is_dear = of_scene["estimate"].isin(DEAR).rename("dear")
    of_scene = of_scene.loc[of_scene.groupby(["model", "setting", is_dear], sort=False)["sharpness"].idxmin()]
    least_bound = of_scene.groupby(["model", "setting"])["bound_of_peak"].transform("min")
    of_scene = of_scene.assign(least=least_bound).sort_values(["least", "model", "setting", "estimate_s"])
    return _labelled(of_scene).assign(estimate=of_scene["estimate"].replace(SOURCES))


def _labelled(rows: pd.DataFrame) -> pd.DataFrame:
    """Name settings in words in the column ``model``."""
    return rows.assign(model=[label(row.model, row.setting) for row in rows.itertuples()])


def _front(settings: pd.DataFrame) -> pd.DataFrame:
    """Return the settings of one scene that no other beats, fastest first."""
    front = _labelled(front_rows(averaged(settings)))
    return front.assign(**_without_truth(front))


def _without_truth(rows: pd.DataFrame) -> dict[str, list[str]]:
    """Return the column that says how many presses without a truth were answered; none where no press was rejected."""
    given = rows[["rejected_answered", "rejected"]].astype(int).to_numpy()
    return {"presses without a truth answered": [f"{k} of {n}" for k, n in given]} if given[:, 1].any() else {}


def _any_load(table: pd.DataFrame, settings: pd.DataFrame) -> pd.DataFrame:
    """Tabulate what to take for each kind of load."""
    rows = []
    for scene in tables.scenes(table):
        loads, own = tables.where(table, scene=scene), operator_error(tables.where(settings, scene=scene), KINDS["rms"])
        for kind in dict.fromkeys(loads["kind"]):
            asked = other_loads(loads, kind, own=own)
            cells = [say("taken", choice(asked, Limit(max_error=max_error))) for max_error in LIMITS]
            cells = [SAME if i and each == cells[i - 1] != NONE else each for i, each in enumerate(cells)]
            heads = [f"error of at most {percent(max_error)}" for max_error in LIMITS]
            rows.append({"scene": spaced(scene), "load": kind} | dict(zip(heads, cells, strict=True)))
    return pd.DataFrame(rows)


def _refusals(table: pd.DataFrame) -> pd.DataFrame:
    """Tabulate what each model refuses, in its own words."""
    rows = []
    for name, refused in table[table["refused"] > 0].groupby("model", sort=False):
        answered = table[(table["model"] == name) & (table["refused"] == 0)]
        never = [kind for kind in dict.fromkeys(refused["kind"]) if kind not in set(answered["kind"])]
        if never:
            reasons = refused[refused["kind"].isin(never)].drop_duplicates("kind")["failure"]
            refusal = "; ".join(dict.fromkeys(reasons.str.replace(r"^contact \d+", "the place", regex=True)))
            rows.append({"model": label(str(name), "default"), "refuses": listed(never), "in its words": refusal})
    return pd.DataFrame(rows)


def models_table(models: pd.DataFrame, families: list[dict]) -> pd.DataFrame:
    """Describe the models that were measured: a row for each family, and for each model of the user's own."""
    n_settings = models.groupby("model", sort=False)["setting"].nunique()
    rejected = models.groupby("model", sort=False)[["rejected", "rejected_answered"]].sum()
    of_families = {name for family in families for name in family["names"]}
    rows = [(family["family"], family, [name for name in family["names"] if name in n_settings]) for family in families]
    rows += [(named(name), _OWN, [name]) for name in n_settings.index if name not in of_families]
    rows = [row for row in rows if row[2]]
    table = pd.DataFrame(
        {
            "model": title,
            "what it does": words["what"],
            "preparation": words["before"],
            "setting": words["setting"],
            "variants": len(names),
            "settings of each": int(n_settings[names].max()),
        }
        for title, words, names in rows
    )
    sums = pd.DataFrame([rejected.loc[names].sum() for _, _, names in rows], columns=rejected.columns)
    return table.assign(**_without_truth(sums))


def given_table(settings: pd.DataFrame) -> pd.DataFrame:
    """Tabulate what models are given: their names, and the least error of any of them in any time, over the scenes."""
    rows = []
    for (sees, prepared), of_group in answers(settings).groupby(["sees", "prepared"], sort=False):
        least = of_group[whole(of_group)].groupby(["scene", "split"])[["rmse_of_peak", "patch_rms_of_peak"]].min()
        rows.append(
            {
                "is given": _GIVEN[sees, bool(prepared)],
                "models": ", ".join(label(name, "default") for name in curves(of_group)),
                "least RMSE": span(least["rmse_of_peak"]),
                "least error at the patch": span(least["patch_rms_of_peak"]),
            }
        )
    return pd.DataFrame(rows)


def variants_table(settings: pd.DataFrame) -> pd.DataFrame:
    """Tabulate the variants that share a curve in the diagrams: the least error of each."""
    variants = settings[settings["model"].isin(FAMILY_OF) & whole(settings)]
    if variants.empty:
        return variants
    wide = pd.concat([averaged(tables.where(variants, scene=scene)) for scene in tables.scenes(variants)])
    wide = wide.pivot_table("rmse_of_peak", "model", "scene", aggfunc="min", sort=False)
    wide = wide.map(percent).rename(index=named, columns=spaced).rename_axis("variant").rename_axis(None, axis=1)
    return wide.reset_index()
