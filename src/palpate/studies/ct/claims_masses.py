"""Judge paper 2's claims on masses from CT: how they change with the mesh, and how fine it has to be."""

from collections.abc import Callable, Iterator, Mapping

import numpy as np
import pandas as pd

from palpate.report.claims import Claim, verdict

TABLES = ("node_mass",)
SYNTHETIC = "abdomen"
MADE_UP = "synthetic: masses of meshes of a real liver differed by 10 %"
"""The body of the shipped settings whose CT is made up, and what a real one gave (docs/papers.md)."""

SPREAD, ENOUGH, GOOD = 0.035, 6000, 0.01
"""The largest difference between meshes that the paper reports, the elements from which on masses are good, and what
good is taken to be: a deviation from the voxels."""


def claims(tables: Mapping[str, pd.DataFrame]) -> Iterator[Claim]:
    """Yield the claims, each for all bodies from a CT, with the voxels as they are, as in the paper."""
    table = tables["node_mass"].sort_values("elements")
    bodies = dict(list(table.groupby("body", sort=False)))
    low, high = table["elements"].min(), table["elements"].max()
    names = ", ".join(name.replace("_", " ") for name in bodies)
    made = f" ({MADE_UP})" if set(bodies) == {SYNTHETIC} else ""
    meshes = f"{names}{made}: meshes of {low} to {high} elements, with the volume of the voxels"
    premise = f"{meshes}; densities as they are at the rim"
    raw = {name: rows["raw_deviation"].to_numpy() + 1.0 for name, rows in bodies.items()}
    yield _claim("1, equation 4", "the total mass rises slightly with the number of elements", premise, "it rises",
                 raw, lambda mass: mass[-1] / mass[0] - 1.0, lambda rise: 0.0 < rise < 2.0 * SPREAD)  # fmt: skip
    yield _claim("2, table 1", "the total masses of meshes differ by at most", premise, "3.5 %",
                 raw, lambda mass: np.ptp(mass) / mass[-1], lambda spread: spread <= SPREAD)  # fmt: skip
    density = {name: rows["mean_density_kg_m3"].to_numpy() for name, rows in bodies.items()}
    own = f"{meshes}; densities of the organ only"
    yield _claim("2, table 1", "the mean density hardly changes with the mesh", own, "hardly",
                 density, lambda mean: np.ptp(mean) / mean[-1], lambda spread: spread <= GOOD)  # fmt: skip
    fine = {name: rows.loc[rows["elements"] >= ENOUGH, "deviation_from_voxels"] for name, rows in bodies.items()}
    if all(len(rows) for rows in fine.values()):
        yield _claim("2, table 1", f"masses are good from {ENOUGH} elements on", own, f"{ENOUGH} elements",
                     fine, lambda off: np.abs(off).max(), lambda most: most <= GOOD)  # fmt: skip


def _claim(
    section: str,
    claim: str,
    premise: str,
    published: str,
    values: Mapping[str, pd.Series],
    measure: Callable[[pd.Series], float],
    holds: Callable[[float], bool],
) -> Claim:
    """Judge a claim by ``holds(measure(values))`` of every body."""
    found = {name: float(measure(each)) for name, each in values.items()}
    ours = ", ".join(f"{name.replace('_', ' ')} {100 * share:.2g} %" for name, share in found.items())
    return Claim(2, section, claim, premise, published, ours, verdict(all(map(holds, found.values()))))
