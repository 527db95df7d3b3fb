"""The numbers that the caption and the headline about scaling name, worked out from its table."""

import numpy as np
import pandas as pd

from palpate.evaluation.scaling.scaling_growth import LARGEST, exponents
from palpate.figures import tables
from palpate.figures.number_format import seconds


def numbers(all_tables: dict[str, pd.DataFrame]) -> dict[str, str]:
    """Every placeholder of these captions, as text."""
    scaling = all_tables["scaling"]
    fem = tables.where(scaling, component="fem")
    largest = fem[fem["size"] == fem["size"].max()]
    press = tables.where(largest, stage="respond").iloc[0]
    memory = f"{1e-3 * largest['memory_mb'].max():.2g} GB"
    return {
        "headline_scaling": (
            f"A press of {press['size']:,} tetrahedra takes {seconds(press['seconds'])} and {memory} on one core; "
            f"the time grows with the elements{_power(press['seconds_exponent'])}."
        ),
        "scaling_elements": f"{press['size']:,}",
        "scaling_seconds": seconds(press["seconds"]),
        "scaling_memory": memory,
        "scaling_whole": _power(_whole(fem)).strip() or "by a power that two sizes would tell",
        "scaling_largest": str(LARGEST),
        "scaling_cores": _speedup(tables.where(scaling, component="cores")),
    }


def _power(exponent: float) -> str:
    """to the power of …, or nothing where it is not known."""
    return f" to the power of {exponent:.2f}" if np.isfinite(exponent) else ""


def _whole(fem: pd.DataFrame) -> float:
    """The exponent of the time of a first press: its matrices' patterns worked out, and then solved."""
    parts = fem[fem["stage"].isin(["set up", "respond"])]
    whole = parts.groupby("size", as_index=False)[["seconds", "memory_mb"]].sum()
    return float(exponents(whole.assign(component="fem", stage="whole"))["seconds_exponent"].iloc[0])


def _speedup(cores: pd.DataFrame) -> str:
    """How much faster a generation is on all cores."""
    by_size = cores.groupby("size")["seconds"].min()
    if len(by_size) < 2:
        return "there is one core only"
    most = by_size.index.max()
    return f"{most} cores are {by_size.loc[by_size.index.min()] / by_size.loc[most]:.2g} times as fast as one"
