"""Report on paper 3, chapter 3: integrators, clusters, what shape matching costs, virtual body springs."""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from palpate.evaluation.shape_matching.shape_matching_growth import HEADLINE, exponents, headline
from palpate.evaluation.shape_matching.tables import TABLES
from palpate.figures import tables
from palpate.figures.number_format import percent, seconds
from palpate.report.material import Report, Section
from palpate.report.paper_claims import Claim, verdict
from palpate.report.words import spaced

__all__ = ["TABLES", "TITLE", "claims", "numbers", "sections"]

TITLE = "Paper 3: shape matching"
SECTIONS = {
    "integrator_stability": "Integrators",
    "clusters": "Clusters",
    "shape_matching_timing": "The time of a step",
    "body_springs": "Virtual body springs",
}
"""Table, figure and caption of this name, and its heading."""
_NEAR = 0.01
"""A measured limit is the paper's if it differs by less than this."""
_LINEAR = 0.15
"""An exponent that differs from 1 by less than this is linear growth."""
_CASES = {"none": "without", "dampers_only": "with their dampers only"}


def numbers(report: Report) -> dict[str, str]:
    """Return every placeholder of these captions, as text."""
    stability, clusters, timing, body_springs = (report.tables[name] for name in SECTIONS)
    published = report.published["shape_matching"]
    return {
        "headline": _headline(timing, published),
        "source": published["source"],
        "blow_up": f"{_limit(stability):.4f} sqrt(m/k), {percent(abs(_limit(stability) / 2 - 1))} from 2",
        "never": _never(stability),
        "growth_error": _growth_error(stability),
        "column_particles": str(clusters["particle"].nunique()),
        "column_force": f"{clusters['force_n'].iloc[0]:g} N",
        "bent": ", ".join(f"{100 * most:.2g} cm with {count}" for count, most in _tips(clusters).items()),
        "slopes": _slopes(timing),
        "poked": _poked(body_springs),
    }


def _limit(stability: pd.DataFrame) -> float:
    """Return the step [sqrt(m/k)] from which a run of symplectic Euler grows."""
    return float(tables.where(stability, scheme="symplectic_euler")["blow_up_measured"].iloc[0])


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
        held = _held(rows)
        last = rows[rows["time_s"] == rows["time_s"].max()]
        depth = held["max_displacement_m"].max()
        name = f"{stiffness:g} N/m" if case == "body_springs" else _CASES.get(case, case)
        phrases.append(
            f"{name}: {1e3 * depth:.2g} mm deep, {held['moved'].sum()} of {held['nodes'].sum()} nodes moved, "
            f"{percent(last['max_displacement_m'].max() / depth)} left"
        )
    return "; ".join(phrases)


def _held(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of the end of the hold."""
    return rows[rows["time_s"] == rows["time_s"][rows["phase"] == "hold"].max()]


def _moved(body_springs: pd.DataFrame) -> pd.Series:
    """Return the share of nodes that have moved at the end of the hold, by stiffness [N/m]; 0 is without springs."""
    held = _held(body_springs[body_springs["case"].isin(["none", "body_springs"])])
    sums = held.groupby("body_springs_n_m")[["moved", "nodes"]].sum()
    return sums["moved"] / sums["nodes"]


def _tips(clusters: pd.DataFrame) -> pd.Series:
    """Return the largest displacement [m] of the column, by number of clusters."""
    moved = clusters[["x_m", "y_m", "z_m"]].to_numpy() - clusters[["rest_x_m", "rest_y_m", "rest_z_m"]].to_numpy()
    return pd.Series(np.linalg.norm(moved, axis=1)).groupby(clusters["clusters"].to_numpy()).max()


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


def claims(report: Report) -> Iterator[Claim]:
    """Judge integrators, the cost of shape matching, clusters, and body springs."""
    paper, stability = "paper 3, chapter 3", report.tables["integrator_stability"]
    found = _limit(stability)
    here = f"from {found:.4f} sqrt(m/k)"
    yield paper, "explicit integration blows up", "beyond 2 sqrt(m/k)", here, verdict(abs(found / 2 - 1) < _NEAR)
    calm = bool(np.isinf(tables.where(stability, scheme="goal_position")["blow_up_measured"]).all())
    here = "at no step" if calm else "they do"
    yield paper, "goal positions at rest never blow up", "at no step", here, verdict(calm)

    timing = report.tables["shape_matching_timing"]
    slopes = exponents(timing)["exponent"]
    here = f"exponent {slopes.min():.2f} to {slopes.max():.2f}"
    linear = bool(((slopes - 1).abs() < _LINEAR).all())
    yield paper, "the cost of shape matching grows with the particles", "linearly", here, verdict(linear)
    step, theirs = 1e-3 * headline(timing), 1 / report.published["shape_matching"]["steps_1_s"]
    claim = f"a step of {HEADLINE['objects']} objects in {HEADLINE['clusters']} quadratic clusters takes at most"
    yield paper, claim, seconds(theirs), f"{seconds(step)} on one core", verdict(step <= theirs)

    tips = _tips(report.tables["clusters"])
    here = ", ".join(f"{100 * tip:.2g} cm in {count}" for count, tip in tips.items())
    yield paper, "a column in more clusters bends farther", "it does", here, verdict(tips.is_monotonic_increasing)
    moved = _moved(report.tables["body_springs"])
    here = ", ".join(f"{percent(share)} of the nodes move at {k:g} N/m" for k, share in moved.items())
    local = moved.is_monotonic_decreasing and moved.iloc[-1] < moved.iloc[0]
    yield paper, "virtual body springs keep a poke local", "they do", here, verdict(local)


def sections(report: Report) -> list[Section]:
    """Return a figure and its folded table each."""
    return [(f"{name}_section", title, report.figure(name) + report.folded(name)) for name, title in SECTIONS.items()]
