"""Try modes of strokes of a region on random strokes that they were not shown, one after another, and sum them up.

    python tests/benchmarks/strokes.py config.yaml config.full.yaml config.deep.yaml --scene liver_palpation --count 24

Errors are from the limit in time of quadratic elements on the same mesh. Strokes that the table has are not tried
again, so that it may be stopped at any time; strokes that modes are learnt from, and limits of those that are tried,
are kept beside it for other settings. Times are the processor's: the least of each step in several runs.
"""

import argparse
from pathlib import Path
from time import process_time, thread_time

import numpy as np
import pandas as pd
from scipy.stats import spearmanr
from snakemake.utils import update_config

from palpate.benchmark.conformal import FEWEST, bound_factor
from palpate.bodies.make_body import make_body
from palpate.errors import NotConverged
from palpate.models import stroke_motion, strokes
from palpate.run.settings import complete, read_settings
from palpate.scenes.run_scene import compose
from palpate.setting_types import plain
from palpate.stores import store, stored
from palpate.studies.dynamic import touching
from palpate.studies.dynamic.compared_scene import ComparedScene
from palpate.studies.dynamic.fitted import Fitted
from palpate.studies.dynamic.settings import TRIED
from palpate.studies.dynamic.strokes import Strokes, learnt_from

RIGHT = 0.01
"""RMSE over peak that is asked for."""
TIMED = 5
"""Runs that times are the least of."""


def main() -> None:
    """Try what the command line asks for, and print a summary after each stroke."""
    asked = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    asked.add_argument("configs", type=Path, nargs="+", help="files of settings; later ones are laid over the first")
    asked.add_argument("--scene", default="liver_palpation")
    asked.add_argument("--count", type=int, default=24)
    asked.add_argument("--seed", type=int, default=4321, help="of the strokes that are tried")
    asked.add_argument(
        "--shown", type=int, help="strokes that modes are learnt from, if not as many as the settings say"
    )
    asked.add_argument("--steps", type=int, nargs="+", help="of modes in a frame, if not those of the settings")
    asked.add_argument("--table", type=Path, default=Path("strokes.csv"))
    given = asked.parse_args()
    compared, grid, seed = scene_of(given.configs, given.scene)
    grid |= {"strokes": given.shown or grid["strokes"], "steps_per_frame": given.steps or grid["steps_per_frame"]}
    shown = shown_to(compared, grid, seed, given.table.with_name(f"{given.scene}_{grid['strokes']}.h5"))
    begin = process_time()
    fitted = touching.modes_of_strokes(compared, shown, grid, seed)
    print(f"strokes took {shown.seconds:.0f} s of the processor, modes {process_time() - begin:.0f} s", flush=True)
    square = grid["half_width_m"], given.count, given.seed
    columns = [*touching.MOTION_PLACES.columns, "times_life"]
    table = pd.read_csv(given.table) if given.table.exists() else pd.DataFrame(columns=columns)
    for number, contact in enumerate(strokes.roaming(compared.particles(-1), compared.loads.contact, *square)):
        if ((table["scene"] == given.scene) & (table["contact"] == number)).any():
            continue
        each = touching.stroked(compared, contact)
        limit = limit_in(given.table.with_name(f"{given.scene}_{given.seed}_{number}_{each.frames}.h5"), each)
        rows = touching.measure_stroke(each, limit, fitted, number, grid["steps_per_frame"])
        for row, per_frame in zip(rows, grid["steps_per_frame"], strict=False):
            row["times_life"] = times_life(each, fitted, per_frame) if row.get("failures") == 0 else np.nan
        table = pd.concat([table, pd.DataFrame(rows)], ignore_index=True).reindex(columns=columns).infer_objects()
        table.to_csv(given.table, index=False)
        print(summary(table).to_string(), flush=True)


def scene_of(configs: list[Path], name: str, model: str = "region_modes") -> tuple[ComparedScene, dict, int]:
    """Return a scene to compare models in, the settings of a ``model`` there, and the seed."""
    given: dict = {}
    for file in configs:
        update_config(given, read_settings(file))
    config = complete(given, configs[0])
    scene, dynamic = config.scenes[name].but(name=name), plain(config.dynamic)
    own = {"duration_s": scene.duration_s, "frames": dynamic["frames"]} | dynamic["scenes"][name]
    body = make_body(scene.body, config.bodies[scene.body])
    kept = {key: own[key] for key in ("duration_s", "frames", "level") if key in own}
    return ComparedScene.of(scene, body, **kept), dict(TRIED[model]), config.seed


def shown_to(compared: ComparedScene, grid: dict, seed: int, file: Path) -> Strokes:
    """Return the strokes that modes are learnt from, of the ``file`` if it is there."""
    if not file.exists():
        region = {key: grid[key] for key in ("half_width_m", "strokes")} | {"seed": seed}
        contacts, begin = learnt_from(compared, region), process_time()
        found = strokes.shown(compared.body, contacts, compared.rayleigh, strokes.DURATION_S)
        store(Strokes(found.astype(np.float32), process_time() - begin), file)
    return stored(Strokes, file)


def limit_in(file: Path, each: ComparedScene) -> touching.StrokeLimit:
    """Return the limit that errors of a stroke are from, of the ``file`` if it is there."""
    if not file.exists():
        store(touching.limit_of(each), file)
    return stored(touching.StrokeLimit, file)


def times_life(each: ComparedScene, fitted: Fitted, per_frame: int, runs: int = TIMED) -> float:
    """Return how much faster than life steps are, NaN if they are not found: the least processor time of each step."""
    scene, particles = fitted.scene(each, per_frame * each.frames), each.particles(fitted.level)
    taken = np.full((runs, scene.steps), np.nan)
    for run in taken:
        system = compose(scene, particles)
        motion = stroke_motion.make(system, scene)
        for number in range(scene.steps):
            system.at((number + 1) * scene.step_s)
            begin = thread_time()
            try:
                motion.advance(scene.step_s)
            except NotConverged:
                return np.nan
            run[number] = thread_time() - begin
    return float(scene.duration_s / taken.min(axis=0).sum())


def summary(table: pd.DataFrame) -> pd.DataFrame:
    """Sum up the strokes of each scene and setting, failures apart.

    rank : Spearman's, of the doubt and the error; coverage : the share of strokes whose error stays below a bound of
    90 % that is the doubt times a factor found on all others
    """
    table = table[table["setting"].notna()]
    found = table[table["failures"] == 0]
    rows = {}
    for key, own in found.groupby(["scene", "setting"]):
        error, doubt = own["rmse_of_peak"].to_numpy(), own["estimate_of_peak"].to_numpy()
        force, life = own["force_rms_of_peak"], own["times_life"]
        rows[key] = {
            "strokes": len(own),
            "quarter": np.quantile(error, 0.25),
            "median": np.median(error),
            "three_quarters": np.quantile(error, 0.75),
            "p90": np.quantile(error, 0.9),
            "worst": error.max(),
            "right": (error <= RIGHT).mean(),
            "force_median": force.median(),
            "force_p90": force.quantile(0.9),
            "times_life": life.median(),
            "slowest": life.min(),
            "rank": spearmanr(doubt, error).statistic if len(own) > 2 else np.nan,
            "coverage": coverage(error, doubt),
        }
    whole = pd.DataFrame(rows).T
    return whole.assign(failed=table.groupby(["scene", "setting"])["failures"].sum().reindex(whole.index))


def coverage(error: np.ndarray, doubt: np.ndarray) -> float:
    """Return the share of strokes below the bound that the others give, NaN if these are too few for one."""
    if len(error) <= FEWEST:
        return np.nan
    numbers, scores = np.arange(len(error)), error / doubt
    others = [numbers != number for number in numbers]
    factors = np.array([bound_factor(scores[these], numbers[these]) for these in others])
    return float((error <= factors * doubt).mean())


if __name__ == "__main__":
    main()
