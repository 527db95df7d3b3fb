"""Judge paper 3's claims on the modes of shape matching, and on clusters taken to the letter."""

from collections.abc import Iterator, Mapping

import numpy as np
import pandas as pd

from palpate.report.claims import CONFIRMED, OUTSIDE, Claim, verdict

TABLES = ("deformation_modes", "cluster_goals")

_FOLLOWS, _MISSES = 1e-9, 0.05
"""What is left of a deformation that a mode follows, and the least that one leaves that cannot."""


def claims(tables: Mapping[str, pd.DataFrame]) -> Iterator[Claim]:
    """Yield the claims."""
    yield from _modes(tables["deformation_modes"])
    yield from _clusters(tables["cluster_goals"])


def _modes(modes: pd.DataFrame) -> Iterator[Claim]:
    left = modes.groupby(["mode", "deformation"], sort=False)["left"].first().unstack("deformation", sort=False)
    premise = f"a block of {modes['particle'].nunique()} particles in one cluster, deformed to second order, β = 1"
    curved = [name for name in left.columns if name != "linear"]
    found = left.loc[["quadratic", "linear"], curved]
    ours = "; ".join(
        f"{mode} misses " + ", ".join(f"{100 * share:.2g} % ({name})" for name, share in row.items())
        for mode, row in found.iterrows()
    )
    holds = bool((found.loc["quadratic"] < _FOLLOWS).all() and (found.loc["linear"] > _MISSES).all())
    claim = "quadratic matching follows bent, twisted and combined shapes, which linear matching cannot"
    yield Claim(3, "3, figure 3.10", claim, premise, "it does", ours, verdict(holds))
    ours = f"linear misses {100 * left.loc['linear', 'linear']:.2g} %, rigid {100 * left.loc['rigid', 'linear']:.2g} %"
    holds = bool(left.loc["linear", "linear"] < _FOLLOWS and left.loc["rigid", "linear"] > _MISSES)
    claim = "linear matching follows stretch and shear, which rigid matching cannot"
    yield Claim(3, "3, figure 3.10", claim, premise, "it does", ours, verdict(holds))


def _clusters(goals: pd.DataFrame) -> Iterator[Claim]:
    rows = goals.set_index(["kind", "goals"])
    letter = rows.loc[("each_tetrahedron", "sum")]
    calm = bool(np.isinf(letter["alpha_limit_measured"]))
    ours = "at no α up to 1" if calm else f"stable below α = {letter['alpha_limit_measured']:.3f} only"
    claim = "goal positions never become unstable, clusters that overlap included"
    premise = (
        f"one cluster a tetrahedron, each adds its pull: {letter['clusters_mean']:.0f} clusters a particle; derived "
        "for one goal a particle"
    )
    yield Claim(3, "3", claim, premise, "at no step, α from 0 to 1", ours, CONFIRMED if calm else OUTSIDE)
    averaged = rows.xs("mean", level="goals")["alpha_limit_measured"]
    premise = "the same clusters and fewer ones, goals averaged"
    ours = "at no α up to 1" if np.isinf(averaged).all() else f"stable below α = {averaged.min():.3f} only"
    yield Claim(3, "3", claim, premise, "at no step, α from 0 to 1", ours, verdict(bool(np.isinf(averaged).all())))
