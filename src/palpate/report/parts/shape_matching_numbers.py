"""The numbers that the captions and the headline of paper 3's experiments name, worked out from their tables."""

import numpy as np
import pandas as pd

from palpate.evaluation.shape_matching.shape_matching_growth import HEADLINE, exponents, headline
from palpate.figures import tables
from palpate.figures.number_format import percent, seconds

_CASES = {"none": "without", "dampers_only": "with their dampers only"}


def numbers(all_tables: dict[str, pd.DataFrame], published: dict) -> dict[str, str]:
    """Every placeholder of these captions, as text.

    published : workflow/report/soft_bodies.yaml, the paper's own numbers
    """
    names = ("integrator_stability", "clusters", "shape_matching_timing")
    stability, clusters, timing = (all_tables[name] for name in names)
    return {
        "source_soft_bodies": published["source"],
        "headline_soft_bodies": _headline(timing, published),
        "blow_up": _blow_up(stability),
        "never": _never(stability),
        "growth_off": _growth_off(stability),
        "column_particles": str(clusters["particle"].nunique()),
        "column_force": f"{clusters['force_n'].iloc[0]:g} N",
        "bent": _bent(clusters),
        "slopes": _slopes(timing),
        "poked": _poked(all_tables["body_springs"]),
    }


def _blow_up(stability) -> str:
    """From which step a run of symplectic Euler grows, in sqrt(m/k)."""
    found = float(tables.where(stability, scheme="symplectic_euler")["blow_up_measured"].iloc[0])
    return f"{found:.4f} sqrt(m/k), {percent(abs(found / 2 - 1))} from 2"


def _never(stability) -> str:
    """The schemes that no step makes grow."""
    calm = stability.groupby("scheme", sort=False)["blow_up_measured"].min()
    return " and ".join(name.replace("_", " ") for name in calm.index[np.isinf(calm)]) or "no scheme"


def _growth_off(stability) -> str:
    """The largest difference between growth a step in a run and by the formula."""
    ratio = stability["growth_measured"] / stability["spectral_radius"]
    return percent(float((ratio - 1).abs().max()))


def _poked(body_springs) -> str:
    """How deep and how wide each surface gives way at the end of the hold, and what is left of that in the end."""
    phrases = []
    for (case, stiffness), rows in body_springs.groupby(["case", "body_springs_n_m"], sort=False):
        held = rows[rows["time_s"] == rows["time_s"][rows["phase"] == "hold"].max()]
        last = rows[rows["time_s"] == rows["time_s"].max()]
        depth = held["max_displacement_m"].max()
        name = f"{stiffness:g} N/m" if case == "body_springs" else _CASES.get(case, case)
        phrases.append(
            f"{name}: {1e3 * depth:.2g} mm deep, {held['moved'].sum()} of {held['nodes'].sum()} nodes moved, "
            f"{percent(last['max_displacement_m'].max() / depth)} left"
        )
    return "; ".join(phrases)


def _bent(clusters) -> str:
    """The largest displacement of the column in so many clusters."""
    moved = clusters[["x_m", "y_m", "z_m"]].to_numpy() - clusters[["rest_x_m", "rest_y_m", "rest_z_m"]].to_numpy()
    farthest = pd.Series(np.linalg.norm(moved, axis=1)).groupby(clusters["clusters"].to_numpy()).max()
    return ", ".join(f"{100 * most:.2g} cm with {count}" for count, most in farthest.items())


def _slopes(timing) -> str:
    """Fitted exponents of the cost in particles, over the numbers of clusters."""
    ranges = exponents(timing).groupby("mode", sort=False)["exponent"].agg(["min", "max"])
    return ", ".join(f"{mode} {row['min']:.2f} to {row['max']:.2f}" for mode, row in ranges.iterrows())


def _headline(timing, published) -> str:
    """The paper's largest scene, here and there."""
    here, there = seconds(1e-3 * headline(timing)), seconds(1 / published["steps_1_s"])
    return (
        f"{HEADLINE['objects']} objects of {HEADLINE['particles']} particles in {HEADLINE['clusters']} "
        f"{HEADLINE['mode']} clusters each take {here} a step on one core (the thesis: {there})."
    )
