"""Measure what flat facets change: the difference between a body of facets and the one on its smooth surface."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from palpate.benchmark.accuracy import TruthErrors, patch_nodes, truth_errors
from palpate.benchmark.truth import FIRST, Truth, ascend, truth_levels
from palpate.bodies.body import Body
from palpate.bodies.refinement import finer
from palpate.bodies.smooth_surface import SmoothSurface

COLUMNS = ["sample", *TruthErrors._fields, "seconds"]
LEVEL = 1
"""Level of the quadratic elements, for an eighth of the time that the next one takes."""
ORDER = 2
"""Order by which facets whose corners are on a smooth surface come nearer to it with every level."""


def geometry_share(
    body: Body,
    surface: SmoothSurface,
    loads: pd.DataFrame,
    truth: Truth,
    samples: Sequence[int],
    progress: Callable = iter,
) -> pd.DataFrame:
    """Tabulate how far the answers of a body of flat facets and of one on its smooth ``surface`` are apart.

    A row for each of ``samples`` that is believed; ``seconds`` is the time of its solution. ``body`` is one of the two,
    whose answer is that of ``truth`` on level 1, the other is made of its coarse mesh. Contacts are the same nodes of
    it, and what is held, the material, the disc that is pressed and the total force are the same, too. Both are
    answered by quadratic elements with equally many unknowns, so that what these leave out nearly cancels. What the
    facets of that level itself leave out, a quarter of the whole on level 1, is added by the order of 2. Errors are
    those of ``truth_errors``. ``progress`` wraps the sequence of all solutions, as ``tqdm`` does.
    """
    level = max(LEVEL, len(body.levels) - 2)
    rows = truth.rows(np.asarray(samples))
    asked = loads.set_index("sample", drop=False).loc[truth.sample[rows]]
    other = finer(replace(body.up_to(0), smooth=surface if body.smooth is None else None), len(body.levels) - 1)
    answers, _ = ascend(other, asked, [range(level, level + 1)] * len(asked), FIRST, progress)
    found = []
    for row, answer in zip(rows, answers, strict=True):
        if answer.failure:
            continue
        own, limit = truth.levels[row, level - truth_levels(body)[0]], truth.displacement[row]
        moved = (answer.surface[0] - own) / (1.0 - 2.0 ** (-ORDER * level))
        patch = patch_nodes(body.fine, int(answer.load["contact"]), float(answer.load["radius_m"]))
        found.append([truth.sample[row], *truth_errors(limit + moved, limit, patch), answer.seconds])
    return pd.DataFrame(found, columns=COLUMNS)
