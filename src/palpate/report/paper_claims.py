"""What each paper claims and what we measure, claim by claim: one table of all papers that were reproduced."""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from palpate.evaluation.shape_matching.shape_matching_growth import HEADLINE, exponents, headline
from palpate.figures import tables
from palpate.figures.number_format import percent, seconds

CONFIRMED, REFUTED, OPEN = "confirmed", "refuted", "cannot be compared"
NEAR = 0.01
"""A measured limit is the paper's if it is off by less than this."""
LINEAR = 0.15
"""An exponent that is off from 1 by less than this is linear growth."""
HOLDS = 1.5
"""Parameters hold for a load that they were not fitted to if its error is less than so many times the fitted one."""
COLUMNS = ("paper", "claim", "the paper", "ours", "verdict")


def verdicts(all_tables: dict[str, pd.DataFrame], published: dict[str, dict]) -> pd.DataFrame:
    """All claims of the papers whose numbers are ``published``, by part; rows of COLUMNS."""
    of = {
        "enrichment": lambda: _checked("paper 1", all_tables["claims"]),
        "springs": lambda: _springs(all_tables["spring_fit"], published["springs"]),
        "soft_bodies": lambda: _soft_bodies(all_tables, published["soft_bodies"]),
        "collision": lambda: _checked("paper 3, ch. 4", _over_all(all_tables["collision_claims"])),
    }
    rows = [row for part, claims in of.items() if part in published for row in claims()]
    return pd.DataFrame(rows, columns=list(COLUMNS))


def _verdict(holds: bool) -> str:
    return CONFIRMED if holds else REFUTED


def _checked(paper: str, claims: pd.DataFrame) -> Iterator[tuple]:
    """Claims that have a table of their own."""
    for row in claims.itertuples(index=False):
        yield paper, row.claim, row.paper, row.ours, row.verdict


def _over_all(claims: pd.DataFrame) -> pd.DataFrame:
    """Of claims that are checked scene by scene, those over all scenes; all of them if there are none."""
    over = claims[claims["claim"].str.endswith("all scenes)")]
    return over if len(over) else claims


def _springs(fits: pd.DataFrame, published: dict) -> Iterator[tuple]:
    """Paper 2: what the genetic algorithm reaches, how long it takes, and whether one press is enough."""
    runs = tables.where(fits, method="genetic", volume_force=False)
    fitted, others = runs[runs["used_in_fit"]], runs[~runs["used_in_fit"]]
    paper, hours = "paper 2", f"{published['seconds'] / 3600:g} h"
    said = f"{published['fitness_m']:g} after {published['generations']:g} generations"
    ours = f"{fitted['fitness'].median():.3g} after {int(fitted['generations'].max())}"
    yield paper, "how well a genetic algorithm fits the springs (its material is not told)", said, ours, OPEN
    taken = seconds(fitted["seconds"].median())
    yield paper, "how long the search takes (its machine is not told)", f"about {hours}", taken, OPEN
    error, worst = fitted["rmse_of_peak"].median(), others.groupby("press")["rmse_of_peak"].median().max()
    yield (
        paper,
        "moduli fitted to the top press hold for the left and the front press too",
        "they do",
        f"{percent(error)} of the peak on the fitted press, up to {percent(worst)} on the others",
        _verdict(worst < HOLDS * error),
    )


def _soft_bodies(all_tables: dict[str, pd.DataFrame], published: dict) -> Iterator[tuple]:
    """Paper 3, chapter 3: integrators, what shape matching costs, clusters, body springs."""
    paper, stability = "paper 3, ch. 3", all_tables["integrator_stability"]
    found = float(tables.where(stability, scheme="symplectic_euler")["blow_up_measured"].iloc[0])
    ours = f"from {found:.4f} sqrt(m/k)"
    yield paper, "explicit integration blows up", "beyond 2 sqrt(m/k)", ours, _verdict(abs(found / 2 - 1) < NEAR)
    calm = bool(np.isinf(tables.where(stability, scheme="goal_position")["blow_up_measured"]).all())
    ours = "at no step" if calm else "they do"
    yield paper, "goal positions at rest never blow up", "at no step", ours, _verdict(calm)

    timing = all_tables["shape_matching_timing"]
    slopes = exponents(timing)["exponent"]
    ours = f"exponent {slopes.min():.2f} to {slopes.max():.2f}"
    linear = bool(((slopes - 1).abs() < LINEAR).all())
    yield paper, "shape matching's cost in particles", "linear", ours, _verdict(linear)
    step, theirs = 1e-3 * headline(timing), 1 / published["steps_1_s"]
    claim = f"a step of {HEADLINE['objects']} objects in {HEADLINE['clusters']} quadratic clusters takes at most"
    yield paper, claim, seconds(theirs), f"{seconds(step)} on one core", _verdict(step <= theirs)

    tips = _tips(all_tables["clusters"])
    ours = ", ".join(f"{100 * tip:.2g} cm in {count}" for count, tip in tips.items())
    yield paper, "a column in more clusters bends farther", "it does", ours, _verdict(tips.is_monotonic_increasing)
    moved = _moved(all_tables["body_springs"])
    ours = ", ".join(f"{percent(share)} of the nodes move at {k:g} N/m" for k, share in moved.items())
    local = moved.is_monotonic_decreasing and moved.iloc[-1] < moved.iloc[0]
    yield paper, "virtual body springs keep a poke local", "they do", ours, _verdict(local)


def _tips(clusters: pd.DataFrame) -> pd.Series:
    """The farthest displacement [m] by number of clusters."""
    moved = clusters[["x_m", "y_m", "z_m"]].to_numpy() - clusters[["rest_x_m", "rest_y_m", "rest_z_m"]].to_numpy()
    return pd.Series(np.linalg.norm(moved, axis=1)).groupby(clusters["clusters"].to_numpy()).max()


def _moved(body_springs: pd.DataFrame) -> pd.Series:
    """The share of nodes that have moved at the end of the hold, by stiffness [N/m]; 0 is without body springs."""
    rows = body_springs[body_springs["case"].isin(["none", "body_springs"])]
    held = rows[rows["time_s"] == rows["time_s"][rows["phase"] == "hold"].max()]
    sums = held.groupby("body_springs_n_m")[["moved", "nodes"]].sum()
    return sums["moved"] / sums["nodes"]
