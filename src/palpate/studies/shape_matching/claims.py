"""Judge paper 3's claims of chapter 3, by its experiments and by its formulas."""

from collections.abc import Iterator, Mapping

import numpy as np
import pandas as pd

from palpate.number_text import percent_in_table as percent
from palpate.report.claims import Claim, claims, verdict
from palpate.report.tables import where
from palpate.report.words import spaced
from palpate.studies.shape_matching.maxwell_creep import closeness
from palpate.studies.shape_matching.shape_matching_timing import HEADLINE, exponents, headline

_TOLERANCE = 0.01
"""A measured limit is the paper's if it differs by less than this."""
_LINEAR = 0.15
"""An exponent that differs from 1 by less than this is linear growth."""
_LEFT = 0.05
"""A body has come back if no more than this share of its largest displacement is left."""
FRAMES_1_S = 50
"""Of the largest scene, on the machine of the thesis."""


@claims("integrator_stability", "body_springs", "clusters", "shape_matching_timing")
def experiments(tables: Mapping[str, pd.DataFrame]) -> Iterator[Claim]:
    yield from _integrators(tables["integrator_stability"])
    yield from _poke(tables["body_springs"])
    yield _column(tables["clusters"])
    yield from _cost(tables["shape_matching_timing"])


def _integrators(stability: pd.DataFrame) -> Iterator[Claim]:
    """Judge the stability of explicit springs and of goal positions by the oscillation of one mass."""
    premise, limit_s = "one mass on one spring, no damping", limit(stability)
    claim, published = "explicit integration of a spring is unstable beyond a step of", "2 sqrt(m/k)"
    ours = f"{limit_s:.4f} sqrt(m/k)"
    yield Claim(3, "3", claim, premise, published, ours, verdict(abs(limit_s / 2 - 1) < _TOLERANCE))
    goals = where(stability, scheme="goal_position")
    never_unstable, longest = bool(np.isinf(goals["blow_up_measured"]).all()), goals["h_over_sqrt_m_k"].max()
    ours = f"at no step up to {longest:.3g} sqrt(m/k)" if never_unstable else "they do"
    premise = "one mass, its goal at rest, no damping"
    yield Claim(3, "3", "goal positions never become unstable", premise, "at no step", ours, verdict(never_unstable))
    error = float((goals["growth_measured"] - 1).abs().max())
    claim = "goal positions keep the amplitude of an oscillation: both eigenvalues have modulus"
    ours = f"1 within {error:.1g} a step, α from {goals['alpha'].min():g} to {goals['alpha'].max():g}"
    yield Claim(3, "3", claim, premise, "1 for any step", ours, verdict(error < _TOLERANCE))


def _poke(body_springs: pd.DataFrame) -> Iterator[Claim]:
    """Judge virtual body springs by a poke, for each of their stiffnesses [N/m]; 0 is the surface without them."""
    premise, section = "a tube's surface held at both ends, poked at one node", "3, figures 3.5, 3.6"
    by_stiffness = pokes(body_springs).set_index("body_springs_n_m").sort_index()
    dampers = by_stiffness["case"] == "dampers_only"
    left_shares, shares = (
        by_stiffness["left_m"] / by_stiffness["depth_m"],
        (by_stiffness["moved"] / by_stiffness["nodes"])[~dampers],
    )
    depths = by_stiffness["depth_m"][~dampers]
    ours = ", ".join(f"{1e3 * depth:.2g} mm deep at {k:g} N/m" for k, depth in depths.items())
    claim = "with virtual body springs a surface resists like a solid"
    yield Claim(3, section, claim, premise, "it does", ours, verdict(depths.is_monotonic_decreasing))
    ours = ", ".join(f"{percent(share)} at {k:g} N/m" for k, share in shares.items()) + " of the nodes move"
    local = shares.is_monotonic_decreasing and shares.iloc[-1] < shares.iloc[0]
    yield Claim(3, section, "virtual body springs keep a poke local", premise, "they do", ours, verdict(local))
    springs = left_shares[~dampers]
    ours = f"{', '.join(f'{percent(max(share, 1e-4))} at {k:g} N/m' for k, share in springs.items())} are left, or less"
    for share in left_shares[dampers]:
        ours += f"; of the same dampers without springs, {percent(max(share, 1e-4))}"
    claim = "with virtual body springs the body comes back when it is released"
    yield Claim(3, section, claim, premise, "it does", ours, verdict(bool((springs[springs.index > 0] < _LEFT).all())))


def _column(clusters: pd.DataFrame) -> Claim:
    moved, particles = tips(clusters), clusters["particle"].nunique()
    ours = "its tip moves " + ", ".join(f"{100 * tip:.2g} cm in {count}" for count, tip in moved.items())
    premise = f"a column of {particles} particles, quadratic clusters that overlap, one load"
    claim = "a column in more clusters deforms more"
    return Claim(3, "3, figure 3.11", claim, premise, "1, 2, 5 clusters", ours, verdict(moved.is_monotonic_increasing))


def _cost(timing: pd.DataFrame) -> Iterator[Claim]:
    """Judge how the time of a step grows with particles, clusters and modes, and how fast the largest scene runs."""
    section, premise = "3, figure 3.12", "objects of 100 particles, one core"
    slopes = exponents(timing)["exponent"]
    linear = bool(((slopes - 1).abs() < _LINEAR).all())
    ours = f"exponent {slopes.min():.2f} to {slopes.max():.2f}"
    claim = "the cost of shape matching grows with the number of particles"
    yield Claim(3, section, claim, premise, "linearly", ours, verdict(linear))
    largest = where(timing, particles=100, objects=timing["objects"].max())
    table = largest.pivot_table(index="clusters", columns="mode", values="ms_per_step")
    for claim, rises, names in (
        ("the cost rises with the number of clusters", table.diff().dropna() > 0, "clusters"),
        ("quadratic clusters cost more than linear ones", table["quadratic"] > table["linear"], "modes"),
    ):
        yield Claim(3, section, claim, premise, "it does", _times(table, names), verdict(bool(np.all(rises))))
    step, holds = headline(timing), headline(timing) <= 1e3 / FRAMES_1_S
    claim = "{objects} objects of {particles} particles in {clusters} quadratic clusters each run at".format(**HEADLINE)
    ours = f"{1e3 / step:.3g} steps a second ({step:.2g} ms a step)"
    premise = "one core, without drawing"
    yield Claim(3, section, claim, premise, f"{FRAMES_1_S} frames a second", ours, verdict(holds))


def _times(table: pd.DataFrame, names: str) -> str:
    """Write the times of a step by number of clusters, or of the modes at the most clusters."""
    if names == "clusters":
        return "; ".join(f"{mode} " + ", ".join(f"{t:.2g} ms in {n}" for n, t in table[mode].items()) for mode in table)
    return f"in {table.index[-1]} clusters: " + ", ".join(f"{mode} {t:.2g} ms" for mode, t in table.iloc[-1].items())


_CLOSE_TO_THEORY = 0.02
"""The largest root mean square distance from the closed solution, over its largest displacement."""


@claims("maxwell_creep")
def creep(tables: Mapping[str, pd.DataFrame]) -> Iterator[Claim]:
    """Yield the claim on creep of springs with Maxwell dampers, by its closed solution."""
    table = tables["maxwell_creep"]
    error, under_load = closeness(table), table[table["load"] > 1.0 - 1e-6]["creep_m"]
    crept = float(under_load.iloc[-1] / under_load.iloc[0] - 1.0)
    ours = f"{100 * crept:.2g} % more under the load that stays, {100 * error:.2g} % from the closed solution"
    claim = "Maxwell dampers beside springs make a body creep as a standard linear solid does"
    premise = f"{spaced(table['scene'].iloc[0])}: small strains, slow against its swings"
    holds = error < _CLOSE_TO_THEORY and crept > 0.0
    yield Claim(3, "3", claim, premise, "the model is given, no figure", ours, verdict(holds))


RECURSION_STEPS, STRETCH = 400, 1.5


@claims()
def formulas(tables: Mapping[str, pd.DataFrame]) -> Iterator[Claim]:
    yield _forced()
    yield from map(_volume, (1.0, 0.8))


def _forced() -> Claim:
    """Judge whether a force changes stability: runs from 1 and from 0 must differ by the same with and without it."""
    alpha = 1.0
    force = np.random.default_rng(1).normal(size=RECURSION_STEPS)
    differences = [_run(1.0, alpha, pushes) - _run(0.0, alpha, pushes) for pushes in (force, 0.0 * force)]
    error = float(np.abs(differences[0] - differences[1]).max() / np.abs(differences[1]).max())
    claim = "forces that depend on neither position nor velocity leave the stability of goal positions as it is"
    ours = f"two runs part as without the force, within {error:.0e}"
    premise = f"the recursion of the paper, {RECURSION_STEPS} steps, a random force, α = {alpha:g}"
    return Claim(3, "3", claim, premise, "the matrix is the same", ours, verdict(error < 1e-9))


def _volume(beta: float) -> Claim:
    """Judge the scaling by det(A)^(−1/3) in linear matching, by its formula for a cluster stretched along one axis."""
    stretched = np.diag([STRETCH, 1.0, 1.0])
    goal = beta * stretched / np.cbrt(np.linalg.det(stretched)) + (1.0 - beta) * np.eye(3)
    change = float(np.linalg.det(goal) - 1.0)
    claim = "linear matching keeps the volume, as A is scaled by det(A)^(-1/3)"
    premise = f"a cluster stretched {STRETCH:g} times, no rotation, β = {beta:g}"
    ours = f"the goals' volume is {percent(abs(change))} larger" if abs(change) > 1e-12 else "the same volume"
    return Claim(3, "3", claim, premise, "it keeps it", ours, verdict(abs(change) < 1e-3))


def _run(start: float, alpha: float, force: np.ndarray) -> np.ndarray:
    """Return the positions over steps of a unit mass with its goal at 0, by the scheme v += α (0 − x) + f, x += v."""
    x, v, path = start, 0.0, []
    for push in force:
        v += push - alpha * x
        x += v
        path.append(x)
    return np.array(path)


_FOLLOWS, _MISSES = 1e-9, 0.05
"""Largest remaining error of a mode that can follow a deformation, and least error of one that cannot."""


@claims("deformation_modes", "cluster_goals")
def modes_and_clusters(tables: Mapping[str, pd.DataFrame]) -> Iterator[Claim]:
    yield from _modes(tables["deformation_modes"])
    yield from _clusters(tables["cluster_goals"])


def _modes(modes: pd.DataFrame) -> Iterator[Claim]:
    """Judge which deformations linear, rigid and quadratic matching can follow."""
    errors = lacking(modes)
    premise = f"a block of {modes['particle'].nunique()} particles in one cluster, deformed to second order, β = 1"
    curved = [name for name in errors.columns if name != "linear"]
    of_curved = errors.loc[["quadratic", "linear"], curved]
    ours = "; ".join(
        f"{mode} misses " + ", ".join(f"{100 * share:.2g} % ({name})" for name, share in row.items())
        for mode, row in of_curved.iterrows()
    )
    holds = bool((of_curved.loc["quadratic"] < _FOLLOWS).all() and (of_curved.loc["linear"] > _MISSES).all())
    claim = "quadratic matching follows bent, twisted and combined shapes, which linear matching cannot"
    yield Claim(3, "3, figure 3.10", claim, premise, "it does", ours, verdict(holds))
    linear, rigid = errors.loc["linear", "linear"], errors.loc["rigid", "linear"]
    ours = f"linear misses {100 * linear:.2g} %, rigid {100 * rigid:.2g} %"
    holds = bool(linear < _FOLLOWS and rigid > _MISSES)
    claim = "linear matching follows stretch and shear, which rigid matching cannot"
    yield Claim(3, "3, figure 3.10", claim, premise, "it does", ours, verdict(holds))


def _clusters(goals: pd.DataFrame) -> Iterator[Claim]:
    """Judge the stability of overlapping clusters, with goals added as in the thesis and averaged."""
    thesis = where(goals, kind="each_tetrahedron", goals="sum").iloc[0]
    always_stable = bool(np.isinf(thesis["alpha_limit_measured"]))
    ours = "at no α up to 1" if always_stable else f"stable below α = {thesis['alpha_limit_measured']:.3f} only"
    claim = "goal positions never become unstable, clusters that overlap included"
    premise = (
        f"one cluster a tetrahedron, each adds its pull: {thesis['clusters_mean']:.0f} clusters a particle; derived "
        "for one goal a particle"
    )
    yield Claim(3, "3", claim, premise, "at no step, α from 0 to 1", ours, verdict(always_stable, within=False))
    averaged = where(goals, goals="mean")["alpha_limit_measured"]
    always_stable = bool(np.isinf(averaged).all())
    premise = "the same clusters and fewer ones, goals averaged"
    ours = "at no α up to 1" if always_stable else f"stable below α = {averaged.min():.3f} only"
    yield Claim(3, "3", claim, premise, "at no step, α from 0 to 1", ours, verdict(always_stable))


def limit(stability: pd.DataFrame) -> float:
    """Return the least step [sqrt(m/k)] at which a run of symplectic Euler grows."""
    return float(where(stability, scheme="symplectic_euler")["blow_up_measured"].iloc[0])


def lacking(modes: pd.DataFrame) -> pd.DataFrame:
    """Return the column ``left`` of deformation_modes.csv for each mode (rows) and deformation (columns)."""
    return modes.groupby(["mode", "deformation"], sort=False)["left"].first().unstack(sort=False)


def held(body_springs: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of body_springs.csv at the end of the hold."""
    return where(body_springs, time_s=where(body_springs, phase="hold")["time_s"].max())


def pokes(body_springs: pd.DataFrame) -> pd.DataFrame:
    """Return a row for each case and stiffness [N/m]: how deep and wide the surface gives way, and what is left of it.

    depth_m, left_m : largest displacement [m] at the end of the hold and of the run; moved, nodes : numbers of nodes
    """
    by_case, last = ["case", "body_springs_n_m"], where(body_springs, time_s=body_springs["time_s"].max())
    depth, left = (rows.groupby(by_case, sort=False)["max_displacement_m"].max() for rows in (held(body_springs), last))
    counts = held(body_springs).groupby(by_case, sort=False)[["moved", "nodes"]].sum()
    return counts.assign(depth_m=depth, left_m=left).reset_index()


def tips(clusters: pd.DataFrame) -> pd.Series:
    """Return the largest displacement [m] of the column, by number of clusters."""
    bent = np.linalg.norm(displacement(clusters), axis=1)
    return pd.Series(bent).groupby(clusters["clusters"].to_numpy()).max()


def displacement(clusters: pd.DataFrame) -> np.ndarray:
    """Return the displacement (rows, 3) [m] of each row's particle."""
    return clusters[["x_m", "y_m", "z_m"]].to_numpy() - clusters[["rest_x_m", "rest_y_m", "rest_z_m"]].to_numpy()
