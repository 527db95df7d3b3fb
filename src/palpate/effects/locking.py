"""Locking of elements in nearly incompressible bodies: where it begins, and the warning to who asks for it."""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from palpate.bodies.material import Tissue

PLAIN_POISSON = 0.45
"""Poisson's ratio up to which plain elements do; above, quadratic ones resist volume on average."""
LOCKED = {0.3: 0.04, 0.45: 0.06, 0.49: 0.12, 0.499: 0.28, 0.4999: 0.49}
"""Share of the displacement under a finger, its mean weighted by the pressure, that linear elements miss by Poisson's
ratio: the bedded liver on level 2, 7865 nodes, 2 % deep, as tests/benchmarks/incompressible.py measures."""


def largest_poisson(tissue: Tissue) -> float:
    """Return the largest Poisson's ratio of the materials of ``tissue``."""
    return max(each.poisson for each in tissue.materials)


def warn_of_locking(name: str, poisson: float) -> None:
    """Warn if linear elements lock at this Poisson's ratio, with the number measured on a liver."""
    if poisson <= PLAIN_POISSON:
        return
    stiffer = [-np.log(1.0 - 2.0 * nu) for nu in LOCKED]
    missing = float(np.interp(-np.log(1.0 - 2.0 * poisson), stiffer, list(LOCKED.values())))
    warnings.warn(
        f"{name}: linear elements lock at Poisson's ratio {poisson:g}; on a liver of 7865 nodes they missed about "
        f"{missing:.0%} of the displacement under a finger: use quadratic elements (fem_p2), or a ratio up to 0.45.",
        stacklevel=2,
    )


@contextmanager
def locking_is_measured() -> Iterator[None]:
    """Leave that warning out, where how much linear elements lock is what is measured."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", ".*linear elements lock")
        yield
