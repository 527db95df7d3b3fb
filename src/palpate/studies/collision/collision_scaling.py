"""Times of building, refitting and querying bounding trees over the number of triangles."""

from collections.abc import Callable

import numpy as np
import pandas as pd

from palpate.studies.collision.collision_growth import STAGES
from palpate.studies.collision.compare_trees import contenders, timed
from palpate.studies.collision.deforming_surfaces import crossing_waves

FRAMES = 3


def measure(triangles: list[int], depths: list[list[int]], report: Callable) -> pd.DataFrame:
    """Measure the rows of collision_scaling.csv on two crossing sheets, in FRAMES frames for each size.

    triangles : approximate numbers of triangles of both sheets together; depths : as in ``compare_trees.contenders``
    report : called with each number of triangles that is done
    Times are medians of processor time on one thread, for both trees together.
    """
    rows = []
    first = crossing_waves(0)
    for make in contenders(depths, with_rivals=True).values():
        _times(make, first.triangles, [first.at(0.0)])  # compiles the kernels
    for number in triangles:
        scene = crossing_waves(number)
        points = [scene.at(0.002 * frame) for frame in range(FRAMES)]
        count = sum(map(len, scene.triangles))
        for (structure, deep, rival), make in contenders(depths, with_rivals=True).items():
            row = {"structure": structure, "depths": deep, "rival": rival, "triangles": count}
            rows.append(row | _times(make, scene.triangles, points) | {"threads": 1})
        report(number)
    return pd.DataFrame(rows)


def _times(make: Callable, triangles: list[np.ndarray], points: list[list[np.ndarray]]) -> dict[str, float]:
    built, one = timed(make, triangles, points[0])
    taken = []
    # without a refit every frame is a build, which the first call has timed
    for at in points:
        update = timed(one.update, at)[0] if one.refits else np.nan
        query, pairs = timed(one.query)
        taken.append((update, query, len(pairs)))
    update, query, pairs = np.median(taken, axis=0)
    return dict(zip(STAGES, (built, update, query), strict=True)) | {"pairs": pairs}
