"""Report on paper 3, chapter 3: integrators, modes, clusters, what shape matching costs, dampers, body springs."""

import numpy as np
import pandas as pd

from palpate.report.material import Report, Section
from palpate.report.number_format import percent, seconds
from palpate.report.words import spaced
from palpate.studies.shape_matching.claims import held, limit, tips
from palpate.studies.shape_matching.report_numbers import of_creep, of_goals, of_modes
from palpate.studies.shape_matching.shape_matching_timing import HEADLINE, exponents, headline
from palpate.studies.shape_matching.tables import TABLES

__all__ = ["TABLES", "TITLE", "numbers", "sections"]

TITLE = "Paper 3: shape matching"
SECTIONS = {
    "integrator_stability": "Integrators",
    "deformation_modes": "Modes",
    "clusters": "Clusters",
    "cluster_goals": "Clusters to the letter",
    "shape_matching_timing": "The time of a step",
    "body_springs": "Virtual body springs",
    "maxwell_creep": "Maxwell dampers",
}
"""Table, figure and caption of this name, and its heading."""
_CASES = {"none": "without", "dampers_only": "with their dampers only"}


def numbers(report: Report) -> dict[str, str]:
    """Return every placeholder of these captions, as text."""
    named = "integrator_stability", "clusters", "shape_matching_timing", "body_springs"
    stability, clusters, timing, body_springs = (report.tables[name] for name in named)
    published = report.published["shape_matching"]
    return {
        "headline": _headline(timing, published),
        "source": published["source"],
        "blow_up": f"{limit(stability):.4f} sqrt(m/k), {percent(abs(limit(stability) / 2 - 1))} from 2",
        "never": _never(stability),
        "growth_error": _growth_error(stability),
        "column_particles": str(clusters["particle"].nunique()),
        "column_force": f"{clusters['force_n'].iloc[0]:g} N",
        "bent": ", ".join(f"{100 * most:.2g} cm with {count}" for count, most in tips(clusters).items()),
        "slopes": _slopes(timing),
        "poked": _poked(body_springs),
        **of_modes(report.tables["deformation_modes"]),
        **of_goals(report.tables["cluster_goals"]),
        **(of_creep(report.tables["maxwell_creep"]) if "maxwell_creep" in report.tables else {}),
    }


def _never(stability: pd.DataFrame) -> str:
    """Name the schemes that no step makes grow."""
    calm = stability.groupby("scheme", sort=False)["blow_up_measured"].min()
    return " and ".join(spaced(name) for name in calm.index[np.isinf(calm)]) or "no scheme"


def _growth_error(stability: pd.DataFrame) -> str:
    """Return the largest difference between the growth of a step in a run and by the formula."""
    ratio = stability["growth_measured"] / stability["spectral_radius"]
    return percent(float((ratio - 1).abs().max()))


def _poked(body_springs: pd.DataFrame) -> str:
    """Return how deep and how wide each surface gives way at the end of the hold, and what is left of it in the end."""
    phrases = []
    for (case, stiffness), rows in body_springs.groupby(["case", "body_springs_n_m"], sort=False):
        end = held(rows)
        last = rows[rows["time_s"] == rows["time_s"].max()]
        depth = end["max_displacement_m"].max()
        name = f"{stiffness:g} N/m" if case == "body_springs" else _CASES.get(case, case)
        phrases.append(
            f"{name}: {1e3 * depth:.2g} mm deep, {end['moved'].sum()} of {end['nodes'].sum()} nodes moved, "
            f"{percent(last['max_displacement_m'].max() / depth)} left"
        )
    return "; ".join(phrases)


def _slopes(timing: pd.DataFrame) -> str:
    """Return fitted exponents of the cost in particles, over the numbers of clusters."""
    ranges = exponents(timing).groupby("mode", sort=False)["exponent"].agg(["min", "max"])
    return ", ".join(f"{mode} {row['min']:.2f} to {row['max']:.2f}" for mode, row in ranges.iterrows())


def _headline(timing: pd.DataFrame, published: dict) -> str:
    """Compare the paper's largest scene, here and there."""
    here, there = seconds(1e-3 * headline(timing)), seconds(1 / published["steps_1_s"])
    return (
        f"A step of {HEADLINE['objects']} objects of {HEADLINE['particles']} particles, in {HEADLINE['clusters']} "
        f"{HEADLINE['mode']} clusters each, takes {here} on one core (the thesis: {there})."
    )


def sections(report: Report) -> list[Section]:
    """Return a figure and its folded table each."""
    shown = {name: title for name, title in SECTIONS.items() if name in report.tables}
    return [(f"{name}_section", title, report.figure(name) + report.folded(name)) for name, title in shown.items()]
