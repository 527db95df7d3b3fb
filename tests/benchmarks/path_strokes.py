"""Judge modes of a path by the truth of its scene, in steps of several lengths and with stiffer contact.

    python tests/benchmarks/path_strokes.py config.yaml --scene liver_palpation --steps 2 3 4 8 --firmer 1 4

It reads the truth and the strokes that the study ``dynamic`` has left in the folder ``results``. Times are the
processor's: the least of each step in several runs, many of which find it on a busy machine, too.
"""

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pandas as pd
from strokes import scene_of, times_life

from palpate.benchmark.accuracy import errors
from palpate.benchmark.motion_truth import MotionTruth, force_errors
from palpate.stores import stored
from palpate.studies.dynamic.compared_scene import ComparedScene
from palpate.studies.dynamic.strokes import Strokes
from palpate.studies.dynamic.touching import modes_of_strokes

RUNS = 40
"""That times are the least of."""


def main() -> None:
    """Print a row for each stiffness and length of steps."""
    asked = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    asked.add_argument("configs", type=Path, nargs="+", help="files of settings; later ones are laid over the first")
    asked.add_argument("--scene", default="liver_palpation")
    asked.add_argument("--results", type=Path, default=Path("results"))
    asked.add_argument("--steps", type=int, nargs="+", default=[2, 3, 4, 8], help="in a frame")
    asked.add_argument("--firmer", type=float, nargs="+", default=[1.0], help="contact over that of the model")
    given = asked.parse_args()
    compared, grid, seed = scene_of(given.configs, given.scene, "path_modes")
    folder = given.results / "data/dynamic" / given.scene
    truth, shown = stored(MotionTruth, folder / "truth.h5"), stored(Strokes, folder / "path_modes.h5")
    print(judge(compared, truth, shown, grid, seed, given.steps, given.firmer).to_string(index=False))


def judge(
    compared: ComparedScene,
    truth: MotionTruth,
    shown: Strokes,
    grid: dict,
    seed: int,
    steps: Sequence[int],
    firmer: Sequence[float],
) -> pd.DataFrame:
    """Return errors over the surface and of the force, in parts of the peak, and how much faster than life steps are.

    steps : numbers of them in a frame; firmer : contact's stiffness over the model's
    """
    learnt = modes_of_strokes(compared, shown, grid, seed)
    known = learnt.scene(compared, compared.frames).touching
    rows = []
    for times in firmer:
        points = known.learnt.points
        modes = known.but(learnt=replace(known.learnt, points=replace(points, penalty=times * points.penalty)))
        model = replace(learnt, scene=lambda scene, count, modes=modes: scene.touching(count, modes))
        for count in steps:
            scene = model.scene(compared, count * compared.frames)
            moved, run = compared.move(scene, len(compared.body.levels) - 1)
            off = errors(moved.reshape(-1, 3), truth.displacement.reshape(-1, 3)).rmse_of_peak
            row = {"firmer": times, "step_s": scene.step_s, "rmse_of_peak": off}
            row |= force_errors(run.motion.instrument_forces(), truth.force)._asdict()
            rows.append(row | {"times_life": times_life(compared, model, count, RUNS)})
    return pd.DataFrame(rows)


if __name__ == "__main__":
    main()
