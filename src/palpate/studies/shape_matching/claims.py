"""Judge paper 3's claims of chapter 3: integrators, body springs, clusters, and the cost of shape matching."""

from collections.abc import Iterator, Mapping

import numpy as np
import pandas as pd

from palpate.report.claims import Claim, percent, verdict
from palpate.studies.shape_matching.findings import held, limit, moved, tips
from palpate.studies.shape_matching.shape_matching_timing import HEADLINE, exponents, headline

TABLES = ("integrator_stability", "body_springs", "clusters", "shape_matching_timing")

_NEAR = 0.01
"""A measured limit is the paper's if it differs by less than this."""
_LINEAR = 0.15
"""An exponent that differs from 1 by less than this is linear growth."""
_LEFT = 0.05
"""A body has come back if no more than this share of its largest displacement is left."""
FRAMES_1_S = 50
"""Of the largest scene, on the machine of the thesis."""


def claims(tables: Mapping[str, pd.DataFrame]) -> Iterator[Claim]:
    """Yield the claims."""
    yield from _integrators(tables["integrator_stability"])
    yield from _poke(tables["body_springs"])
    yield _column(tables["clusters"])
    yield from _cost(tables["shape_matching_timing"])


def _integrators(stability: pd.DataFrame) -> Iterator[Claim]:
    """Judge limits of stability, and the growth of an oscillation in a step."""
    premise, found = "one mass on one spring, no damping", limit(stability)
    claim, published = "explicit integration of a spring is unstable beyond a step of", "2 sqrt(m/k)"
    ours = f"{found:.4f} sqrt(m/k)"
    yield Claim(3, "3", claim, premise, published, ours, verdict(abs(found / 2 - 1) < _NEAR))
    goals = stability[stability["scheme"] == "goal_position"]
    calm, longest = bool(np.isinf(goals["blow_up_measured"]).all()), goals["h_over_sqrt_m_k"].max()
    ours = f"at no step up to {longest:.3g} sqrt(m/k)" if calm else "they do"
    premise = "one mass, its goal at rest, no damping"
    yield Claim(3, "3", "goal positions never become unstable", premise, "at no step", ours, verdict(calm))
    error = float((goals["growth_measured"] - 1).abs().max())
    claim = "goal positions keep the amplitude of an oscillation: both eigenvalues have modulus"
    ours = f"1 within {error:.1g} a step, α from {goals['alpha'].min():g} to {goals['alpha'].max():g}"
    yield Claim(3, "3", claim, premise, "1 for any step", ours, verdict(error < _NEAR))


def _poke(body_springs: pd.DataFrame) -> Iterator[Claim]:
    """Judge virtual body springs, by their stiffness [N/m]; 0 is the surface without them."""
    premise, section = "a tube's surface held at both ends, poked at one node", "3, figures 3.5, 3.6"
    shown = body_springs[body_springs["case"].isin(["none", "body_springs"])]
    depths = held(shown).groupby("body_springs_n_m")["max_displacement_m"].max()
    ours = ", ".join(f"{1e3 * depth:.2g} mm deep at {k:g} N/m" for k, depth in depths.items())
    claim = "with virtual body springs a surface resists like a solid"
    yield Claim(3, section, claim, premise, "it does", ours, verdict(depths.is_monotonic_decreasing))
    shares = moved(body_springs)
    ours = ", ".join(f"{percent(share)} at {k:g} N/m" for k, share in shares.items()) + " of the nodes move"
    local = shares.is_monotonic_decreasing and shares.iloc[-1] < shares.iloc[0]
    yield Claim(3, section, "virtual body springs keep a poke local", premise, "they do", ours, verdict(local))
    last = body_springs[body_springs["time_s"] == body_springs["time_s"].max()]
    left = last[last["case"] != "dampers_only"].groupby("body_springs_n_m")["max_displacement_m"].max() / depths
    tied = left[left.index > 0]
    ours = f"{', '.join(f'{percent(max(share, 1e-4))} at {k:g} N/m' for k, share in left.items())} are left, or less"
    still = last[last["case"] == "dampers_only"]["max_displacement_m"].max()
    if pd.notna(still):
        deep = held(body_springs)
        still /= deep[deep["case"] == "dampers_only"]["max_displacement_m"].max()
        ours += f"; of the same dampers without springs, {percent(max(still, 1e-4))}"
    claim = "with virtual body springs the body comes back when it is released"
    yield Claim(3, section, claim, premise, "it does", ours, verdict(bool((tied < _LEFT).all())))


def _column(clusters: pd.DataFrame) -> Claim:
    """Judge how far a column bends in more clusters."""
    found, particles = tips(clusters), clusters["particle"].nunique()
    ours = "its tip moves " + ", ".join(f"{100 * tip:.2g} cm in {count}" for count, tip in found.items())
    premise = f"a column of {particles} particles, quadratic clusters that overlap, one load"
    claim = "a column in more clusters deforms more"
    return Claim(3, "3, figure 3.11", claim, premise, "1, 2, 5 clusters", ours, verdict(found.is_monotonic_increasing))


def _cost(timing: pd.DataFrame) -> Iterator[Claim]:
    """Judge how the time of a step grows, and whether the largest scene is interactive."""
    section, premise = "3, figure 3.12", "objects of 100 particles, one core"
    slopes = exponents(timing)["exponent"]
    linear = bool(((slopes - 1).abs() < _LINEAR).all())
    ours = f"exponent {slopes.min():.2f} to {slopes.max():.2f}"
    claim = "the cost of shape matching grows with the number of particles"
    yield Claim(3, section, claim, premise, "linearly", ours, verdict(linear))
    largest = timing[(timing["particles"] == 100) & (timing["objects"] == timing["objects"].max())]
    table = largest.pivot_table(index="clusters", columns="mode", values="ms_per_step")
    for claim, rises, names in (
        ("the cost rises with the number of clusters", table.diff().dropna() > 0, "clusters"),
        ("quadratic clusters cost more than linear ones", table["quadratic"] > table["linear"], "modes"),
    ):
        yield Claim(3, section, claim, premise, "it does", _times(table, names), verdict(bool(np.all(rises))))
    step, theirs = headline(timing), 1e3 / FRAMES_1_S
    objects, particles, clusters = (HEADLINE[key] for key in ("objects", "particles", "clusters"))
    claim = f"{objects} objects of {particles} particles in {clusters} quadratic clusters each run at"
    ours = f"{1e3 / step:.3g} steps a second ({step:.2g} ms a step)"
    yield Claim(
        3, section, claim, "one core, without drawing", f"{FRAMES_1_S} frames a second", ours, verdict(step <= theirs)
    )


def _times(table: pd.DataFrame, names: str) -> str:
    """Write the times of a step by number of clusters, or of the modes at the most clusters."""
    if names == "clusters":
        return "; ".join(f"{mode} " + ", ".join(f"{t:.2g} ms in {n}" for n, t in table[mode].items()) for mode in table)
    return f"in {table.index[-1]} clusters: " + ", ".join(f"{mode} {t:.2g} ms" for mode, t in table.iloc[-1].items())
