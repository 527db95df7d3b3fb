"""Judge claims of paper 3, chapter 3, that follow from its formulas alone: outer forces, and the volume of goals."""

from collections.abc import Iterator, Mapping

import numpy as np
import pandas as pd

from palpate.report.claims import Claim, percent, verdict

TABLES = ()

ALPHA, STEPS = 1.0, 400
STRETCH, BETAS = 1.5, (1.0, 0.8)


def claims(tables: Mapping[str, pd.DataFrame]) -> Iterator[Claim]:
    """Yield the claims."""
    yield _forced(ALPHA)
    yield from map(_volume, BETAS)


def _forced(alpha: float) -> Claim:
    """Judge forces from outside by the scheme itself: two runs under the same force part as they do without it."""
    force = np.random.default_rng(1).normal(size=STEPS)
    parted = [_run(1.0, alpha, load) - _run(0.0, alpha, load) for load in (force, 0.0 * force)]
    error = float(np.abs(parted[0] - parted[1]).max() / np.abs(parted[1]).max())
    claim = "forces that depend on neither position nor velocity leave the stability of goal positions as it is"
    ours = f"two runs part as without the force, within {error:.0e}"
    premise = f"the recursion of the paper, {STEPS} steps, a random force, α = {alpha:g}"
    return Claim(3, "3", claim, premise, "the matrix is the same", ours, verdict(error < 1e-9))


def _volume(beta: float) -> Claim:
    """Judge det(A)^(−1/3) by the formula of linear matching, for a cluster that is stretched along one axis."""
    stretched = np.diag([STRETCH, 1.0, 1.0])
    goal = beta * stretched / np.cbrt(np.linalg.det(stretched)) + (1.0 - beta) * np.eye(3)
    change = float(np.linalg.det(goal) - 1.0)
    claim = "linear matching keeps the volume, as A is scaled by det(A)^(-1/3)"
    premise = f"a cluster stretched {STRETCH:g} times, no rotation, β = {beta:g}"
    ours = f"the goals' volume is {percent(abs(change))} larger" if abs(change) > 1e-12 else "the same volume"
    return Claim(3, "3", claim, premise, "it keeps it", ours, verdict(abs(change) < 1e-3))


def _run(start: float, alpha: float, force: np.ndarray) -> np.ndarray:
    """Return the positions of a unit mass that is pulled to 0 in steps of 1: v += α (0 − x) + f, x += v."""
    x, v, path = start, 0.0, []
    for push in force:
        v += push - alpha * x
        x += v
        path.append(x)
    return np.array(path)
