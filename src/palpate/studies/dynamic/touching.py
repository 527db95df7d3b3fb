"""Models of a touched body in modes of strokes: those beside its path, or those of a region."""

from collections.abc import Iterator, Mapping
from time import perf_counter
from typing import Any

import numpy as np

from palpate.models import strokes, touching_motion
from palpate.scenes.run_scene import Run, compose
from palpate.scenes.scene import Scene
from palpate.studies.dynamic.compared_scene import ComparedScene
from palpate.studies.dynamic.fitted import Fitted
from palpate.studies.dynamic.strokes import Strokes

ASKED = ("vibrations", "modes", "states", "thinning", "tolerance")
"""What of a model's settings is the block ``touching`` of a scene."""


def modes_of_strokes(compared: ComparedScene, shown: Strokes, grid: Mapping[str, Any], seed: int) -> Fitted:
    """Learn modes from strokes; those of a region are not shown the path of ``compared``.

    grid : the settings of the model; nodes are in reach that the path or a stroke of its kind passes, more of them
        than were shown
    """
    asked, begin = {key: grid[key] for key in ASKED}, perf_counter()
    passing = None
    if "half_width_m" in grid:
        passing = strokes.roaming(
            compared.particles(-1), compared.loads["contact"], grid["half_width_m"], MORE * grid["strokes"], seed
        )
    system = compose(compared.touching(compared.frames, asked), compared.particles(-1))
    body = touching_motion.prepare(system, asked, shown.shown, passing)

    def in_modes(compared: ComparedScene, steps: int) -> Scene:
        return compared.touching(steps, asked | {"learnt": body})

    spent = shown.seconds + perf_counter() - begin
    return Fitted(in_modes, compared.body.material.young_pa, spent, level=-1)


MORE = 4
"""Strokes of a region that say what is in reach, for each that is learnt from."""


def tried(
    compared: ComparedScene, shown: Strokes, grid: Mapping[str, Any], seed: int
) -> Iterator[tuple[int, Fitted, str]]:
    """Yield steps in modes of strokes."""
    fitted = modes_of_strokes(compared, shown, grid, seed)
    for count in grid["steps_per_frame"]:
        yield count * compared.frames, fitted, ""


def doubted(run: Run, moved: np.ndarray) -> float:
    """Return the largest doubt of a motion, of the peak of its displacements ``moved`` (f, n_surface, 3) [m]."""
    return float(run.doubts_m.max() / np.linalg.norm(moved, axis=2).max())
