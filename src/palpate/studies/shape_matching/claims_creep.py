"""Judge paper 3's claim on Maxwell dampers, a spring and a damper in series."""

from collections.abc import Iterator, Mapping

import pandas as pd

from palpate.report.claims import Claim, verdict
from palpate.studies.shape_matching.maxwell_creep import closeness

TABLES = ("maxwell_creep",)

_NEAR = 0.02
"""The largest root mean square distance from the closed solution, over its largest displacement."""


def claims(tables: Mapping[str, pd.DataFrame]) -> Iterator[Claim]:
    """Yield the claim."""
    table = tables["maxwell_creep"]
    error, held = closeness(table), table[table["load"] > 1.0 - 1e-6]["creep_m"]
    crept = float(held.iloc[-1] / held.iloc[0] - 1.0)
    ours = f"{100 * crept:.2g} % more under the load that stays, {100 * error:.2g} % from the closed solution"
    claim = "Maxwell dampers beside springs make a body creep as a standard linear solid does"
    premise = f"{str(table['scene'].iloc[0]).replace('_', ' ')}: small strains, slow against its swings"
    yield Claim(3, "3", claim, premise, "the model is given, no figure", ours, verdict(error < _NEAR and crept > 0.0))
