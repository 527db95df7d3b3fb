"""Find the truth: the limit of quadratic elements on ever finer levels of a body, with an error of its own.

It is read by evaluation only; no model ever sees it.
"""

import warnings
from collections.abc import Callable, Collection
from dataclasses import dataclass

import numpy as np
import pandas as pd

from palpate.benchmark.accuracy import TruthErrors, patch_nodes, truth_errors
from palpate.benchmark.nested_levels import Ascent, ascend, truth_levels
from palpate.bodies.body import Body
from palpate.errors import InputError
from palpate.models.richardson import RATIOS, doubt, limit, ratio

NEXT = 1e-4
"""Tolerance of a solution that starts from the level before: with 1e-7 the limit is the same to 0.001 % of the peak."""
SQUEEZED = 0.5
"""Determinants of the deformation gradient below this are counted, and not objected to: at the edge of an anchor or of
a facet they fall with every halving, to 0.01 on the liver, where ratios are 2.3 to 2.5 and limits agree to 0.2 %."""
OWN = TruthErrors._fields


@dataclass(frozen=True, eq=False)
class Truth:
    """The truth of k samples on the n fine surface nodes of a body.

    sample : (k,) sample numbers; contact : (k,) coarse nodes
    displacement : (k, n, 3) [m], the limit, or the finest level where there is none; NaN where a level had no answer
    levels : (k, n_levels, n, 3) [m], the answer of each level, coarse first; NaN where a sample goes without it
    ratio, order : (k,) by how much the last halving reduced the change, as it is, and its logarithm to base 2
    least_det : (k,) the least determinant of the deformation gradient at any point of integration of any level
    volume_change : (k,) of the body on the finest level of each sample, over its volume at rest
    iterations, products : (k,) iterations of L-BFGS and Newton's method, and multigrid cycles, of all levels together
    own : (k, len(OWN)) the error that the limit may have itself, as ``TruthErrors``
    rejected : (k,) why a sample's limit is not believed, or ""
    seconds : (k,) time of its solutions [s]
    radius_m : of the disc that is pressed [m]
    level, elements, nodes : number and size of the finest level
    """

    sample: np.ndarray
    contact: np.ndarray
    displacement: np.ndarray
    levels: np.ndarray
    ratio: np.ndarray
    order: np.ndarray
    least_det: np.ndarray
    volume_change: np.ndarray
    iterations: np.ndarray
    products: np.ndarray
    own: np.ndarray
    rejected: np.ndarray
    seconds: np.ndarray
    radius_m: float
    level: int
    elements: int
    nodes: int

    @property
    def believed(self) -> np.ndarray:
        """Truth values (k,): which samples' limits are believed."""
        return self.rejected == ""

    def spread(self, count: int) -> np.ndarray:
        """Return the numbers of ``count`` samples whose limit is believed, or of all, spread over their order."""
        believed = self.sample[self.believed]
        return believed[np.linspace(0, len(believed) - 1, min(count, len(believed))).round().astype(int)]

    def rows(self, numbers: np.ndarray) -> np.ndarray:
        """Return the rows of those of the samples ``numbers`` whose limit is believed; InputError for one not here.

        Where none of them is, those that have an answer at all: what is measured by them says how uncertain it is.
        """
        if missing := sorted(set(numbers) - set(self.sample)):
            raise InputError(f"truth.h5: sample {missing[0]} has no truth; delete the file and type make.")
        found = np.array([int(np.flatnonzero(self.sample == number)[0]) for number in numbers], dtype=int)
        believed = found[self.believed[found]]
        return believed if len(believed) else found[np.isfinite(self.displacement[found]).all(axis=(1, 2))]


def truth_of(
    body: Body, loads: pd.DataFrame, finest: Collection[int], progress: Callable = iter, tolerance: float = NEXT
) -> Truth:
    """Find the truth of every row of ``loads``.

    finest : the sample numbers that get the finest level; the others do without it where three levels are left
    progress : wraps the sequence of all solutions, as ``tqdm`` does
    tolerance : relative residual at which a solution that starts from the level before stops
    """
    levels = truth_levels(body)
    wanted = [levels if len(levels) < 4 or sample in finest else levels[:-1] for sample in loads["sample"]]
    ascents, whole = ascend(body, loads, wanted, tolerance, progress)
    judged = [_judge(body, each) for each in ascents]
    displacement, rates, own, rejected = (np.array(part) for part in zip(*judged, strict=True))
    _warn_of_rejected(body.name, rejected)
    last = max(each.levels[-1] for each in ascents)
    return Truth(
        sample=loads["sample"].to_numpy(dtype=int),
        contact=loads["contact"].to_numpy(dtype=int),
        displacement=displacement,
        levels=np.array([_filled(each, len(levels), body) for each in ascents]),
        ratio=rates,
        order=np.log2(rates),
        least_det=np.array([each.least_det for each in ascents]),
        volume_change=np.array([each.volume_change for each in ascents]),
        iterations=np.array([each.iterations for each in ascents]),
        products=np.array([each.products for each in ascents]),
        own=own,
        rejected=rejected.astype(object),
        seconds=np.array([each.seconds for each in ascents]),
        radius_m=float(loads["radius_m"].iloc[0]),
        level=last,
        elements=len(whole.levels[last].tetrahedra),
        nodes=len(whole.levels[last + 1].nodes),
    )


def _judge(body: Body, each: Ascent) -> tuple[np.ndarray, float, TruthErrors, str]:
    """Return the limit of one sample, its ratio, its own error, and why it is not believed."""
    if each.failure:
        nothing = TruthErrors(*[np.nan] * len(OWN))
        return np.full((len(body.fine.surface), 3), np.nan), np.nan, nothing, each.failure
    levels = np.array(each.surface)
    rate = ratio(levels)
    patch = patch_nodes(body.fine, int(each.load["contact"]), float(each.load["radius_m"]))
    if RATIOS[0] <= rate <= RATIOS[1]:
        found = limit(levels)
        own = truth_errors(found + doubt(levels), found, patch)
    else:  # the levels have no limit that could be seen, and the finest is as good as any
        found = levels[-1]
        own = truth_errors(levels[-2], found, patch)
    return found, rate, own, _objection(each, rate)


def _objection(each: Ascent, rate: float) -> str:
    """Return why a limit is not believed, or nothing."""
    low, high = RATIOS
    said = []
    if not low <= rate <= high:
        said.append(f"the ratio {rate:.3g} is not within {low:g} to {high:g}")
    if not each.least_det > 0.0:
        said.append(f"an element is inverted (det F {each.least_det:.3g})")
    if each.clamped:
        said.append("the Hessian had to be clamped")
    return "; ".join(said)


def _warn_of_rejected(name: str, rejected: np.ndarray) -> None:
    """Warn of presses without a truth; rejected : (k,) why, or ""."""
    if reasons := [str(why) for why in rejected if why]:
        whole = len(reasons) == len(rejected)
        warnings.warn(
            f"bodies.{name}: {len(reasons)} of {len(rejected)} presses have no truth that is believed "
            f"({reasons[0]}); "
            + (
                "models are judged by the finest level, which may be far from it; hold more than single nodes "
                "(anchors, or a bed), press less, or refine the body."
                if whole
                else "they are left out."
            ),
            stacklevel=3,
        )


def _filled(each: Ascent, count: int, body: Body) -> np.ndarray:
    """Return the answers of one sample, (count, n, 3) [m], with NaN for levels that it has gone without."""
    filled = np.full((count, len(body.fine.surface), 3), np.nan)
    filled[: len(each.surface)] = each.surface if each.surface else np.nan
    return filled
