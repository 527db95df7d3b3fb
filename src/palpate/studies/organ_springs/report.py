"""Report on paper 2's chain for an organ: its masses, its fitted springs, and how good they are elsewhere."""

import pandas as pd

from palpate.report import markup, tables
from palpate.report.material import Report, Section
from palpate.report.number_format import each, percent, seconds
from palpate.studies.organ_springs.figures import look
from palpate.studies.organ_springs.tables import TABLES

__all__ = ["TABLES", "TITLE", "numbers", "sections"]

TITLE = "Paper 2: springs of an organ"
SEARCHES = ("genetic", "cma_es", "gradient")


def numbers(report: Report) -> dict[str, str]:
    """Return every placeholder of these captions, as text; a phrase for each body where there are several."""
    springs, masses = report.tables["organ_springs"], report.tables["mass_motion"]
    bodies = tables.bodies(springs)

    def phrases(phrase, table):
        return each(bodies, lambda body: phrase(tables.where(table, body=body)))

    fitted = phrases(_fitted, springs)
    counts = springs.groupby("used_in_fit")["contact"].nunique()
    return {
        "headline": f"Springs of an organ, RMSE of the peak at contacts that no fit saw: {fitted}.",
        "organ_contacts": f"{counts[True]} contacts and tested at {counts[False]} others",
        "organ_reference": phrases(_reference, springs),
        "organ_worst": phrases(_worst, springs),
        "organ_times": phrases(_times, springs),
        "organ_errors": phrases(_errors, springs),
        "organ_rivals": phrases(_rivals, springs),
        "organ_masses": phrases(_masses, masses),
    }


def means(springs: pd.DataFrame) -> pd.DataFrame:
    """Return of each model and step the mean errors ``fitted`` and ``tested``, and the median time, by model.

    Errors are medians over the seeds of a search; ``low``, ``high`` are the range of ``tested`` over so many ``seeds``.
    """
    setting = ["model", "volume_force", "step_s"]
    found = springs.groupby(setting, sort=False)[["ms_a_second", "offline_s"]].median()
    for name, used in (("fitted", True), ("tested", False)):
        part = springs[springs["used_in_fit"] == used]
        means = part.groupby([*setting, "seed"], sort=False)["rmse_of_peak"].mean().groupby(setting, sort=False)
        found[name] = means.median()
    return found.assign(low=means.min(), high=means.max(), seeds=means.size()).reset_index()


def best(springs: pd.DataFrame) -> pd.DataFrame:
    """Return of each model the row of ``means`` with the least error at tested contacts, indexed by model."""
    found = means(springs)
    return found.loc[found.groupby("model", sort=False)["tested"].idxmin()].set_index("model")


def _fitted(springs: pd.DataFrame) -> str:
    found = best(springs)
    parts = [f"{look(name).label} {percent(found.loc[name, 'tested'])}" for name in SEARCHES if name in found.index]
    return f"{', '.join(parts)}, coarse finite elements {percent(found.loc['coarse_fem', 'tested'])}"


def _errors(springs: pd.DataFrame) -> str:
    parts = []
    for name, row in best(springs).drop(index=["zero", "coarse_fem", "shape_matching"]).iterrows():
        errors = f"{percent(row['fitted'])} and {percent(row['tested'])}"
        if row["seeds"] > 1:
            errors += f" (median of {row['seeds']:.0f} seeds, {percent(row['low'])} to {percent(row['high'])})"
        parts.append(f"{look(str(name)).label} {errors} in {seconds(row['offline_s'])}")
    return "; ".join(parts)


def _rivals(springs: pd.DataFrame) -> str:
    found = best(springs)
    genetic = found.loc["genetic"]
    parts = [f"the springs {percent(genetic['tested'])} in {genetic['ms_a_second']:.3g} ms"]
    for name in ("shape_matching", "coarse_fem", "zero"):
        row = found.loc[name]
        time = "" if name == "zero" else f" in {row['ms_a_second']:.3g} ms"
        parts.append(f"{look(name).label} {percent(row['tested'])}{time}")
    return ", ".join(parts)


def _worst(springs: pd.DataFrame) -> str:
    """Return how much of what searches gain is at the one fitted contact where springs without a search are worst."""
    fitted = springs[springs["used_in_fit"]]
    names = [name for name in ("van_gelder", *SEARCHES) if name in set(fitted["model"])]
    errors = fitted[fitted["model"].isin(names)].pivot_table("rmse_of_peak", "contact", "model", aggfunc="median")[
        names
    ]
    worst = errors[names[0]].idxmax()
    others = errors.drop(index=worst).mean()
    parts = [f"{look(name).label} {percent(errors.loc[worst, name])}" for name in names]
    if others.isna().all():
        return f"at contact {worst} {', '.join(parts)}"
    rest = [f"{percent(others[name])}" for name in names]
    return f"at contact {worst} {', '.join(parts)}; in the mean of the other fitted contacts {', '.join(rest)}"


def _times(springs: pd.DataFrame) -> str:
    """Return the least time of springs, of shapes and of coarse finite elements."""
    times = springs.groupby(["model", "step_s"])["ms_a_second"].median().groupby("model").min()
    names = {"genetic": "springs", "shape_matching": "shape matching", "coarse_fem": "coarse finite elements from"}
    return ", ".join(f"{words} {times[name]:.3g} ms" for name, words in names.items())


def _reference(springs: pd.DataFrame) -> str:
    error = springs.drop_duplicates("contact")["reference_error"]
    return f"{percent(error.min())} to {percent(error.max())}"


def _masses(masses: pd.DataFrame) -> str:
    """Return what uniform masses change, or that there is no CT."""
    if not masses["from_ct"].astype(bool).any():
        return "it has no CT, and uniform masses"
    own, uniform, mean = (tables.where(masses, masses=name).iloc[0] for name in ("own", "uniform", "mean"))
    nodes = f"{own['least_node_of_uniform']:.3f} to {own['most_node_of_uniform']:.3f} times"
    return (
        f"{own['total_kg']:.4g} kg from the voxels and {uniform['total_kg']:.4g} kg at its density_kg_m3, single nodes "
        f"{nodes} as much; uniform masses change the slowest frequencies by {percent(uniform['change_of_frequency'])} "
        f"and the motion by {percent(uniform['change_of_motion'])} of the peak, with the same total mass by "
        f"{percent(mean['change_of_frequency'])} and {percent(mean['change_of_motion'])}"
    )


def sections(report: Report) -> list[Section]:
    """Return the one section."""
    table = markup.table(
        _tabulated(report.tables["organ_springs"]),
        "Mean RMSE of the peak displacement; medians over seeds, whose range is that at other contacts",
    )
    folded = report.folded("organ_springs", "organ_history", "mass_motion")
    return [("organ_springs", "From CT to springs", report.figure("organ_springs") + table + folded)]


def _tabulated(springs: pd.DataFrame) -> pd.DataFrame:
    rows = []
    for body, found in springs.groupby("body", sort=False):
        for row in means(found).itertuples():
            rows.append(
                {
                    "body": body,
                    "model": look(row.model).label + (" and volume force" if row.volume_force else ""),
                    "step [ms]": f"{1e3 * row.step_s:.3g}",
                    "search": seconds(row.offline_s) if row.offline_s else "",
                    "ms a second": "" if row.model == "zero" else f"{row.ms_a_second:.3g}",
                    "fitted contacts": percent(row.fitted),
                    "other contacts": percent(row.tested),
                    "seeds": f"{row.seeds}: {percent(row.low)} to {percent(row.high)}" if row.seeds > 1 else "",
                }
            )
    return pd.DataFrame(rows)
