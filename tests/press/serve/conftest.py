"""A finished run of the slab, as ``make`` leaves it behind."""

from pathlib import Path

import pandas as pd
import pytest

from palpate.benchmark.database import fold_table, write
from palpate.benchmark.press_measure import ACCURACY_VS_TIME
from palpate.bodies.body_file import save
from palpate.press.finished_run import FinishedRun
from palpate.press.serve.live_models import LiveModels

CONFIG = """\
bodies:
  slab: {kind: box, sizes_m: [0.2, 0.1, 0.1], divisions: [4, 2, 2], refinements: 1, young_pa: 3000, poisson: 0.3,
         density_kg_m3: 1000, anchors: {plane: {axis: x, side: min, depth_m: 0.001}}}
regimes: {large: {peak_of_size: 0.1, radius_m: 0.03}}
tradeoff: {}
"""
SETTINGS = {  # error on validation contacts, 95th percentile of time [s]
    ("fem_p1", "level=0, start=rest, tolerance=0.001"): (0.05, 0.01),
    ("fem_p1", "level=1, start=rest, tolerance=0.001"): (0.02, 0.05),
    ("fem_p1", "level=1, start=rest, tolerance=1e-08"): (0.01, 0.5),
    ("fem_p1", "level=1, start=linear, tolerance=0.001"): (0.001, 0.01),
    ("fem_p1", "level=1, start=frame, iterations=1"): (0.001, 0.01),
    ("linear_fem", "default"): (0.1, 1e-5),
}


@pytest.fixture(scope="session")
def finished(slab_case, tmp_path_factory) -> Path:
    """The folder of config.yaml and results/."""
    case, folder = slab_case[0], tmp_path_factory.mktemp("finished run")
    (folder / "config.yaml").write_text(CONFIG)
    place = folder / "results/data/slab/large"
    save(case.body, place.parent / "body.h5")
    write(case.database, place / "database.h5")
    fold_table(case.database, 1).to_csv(place / "samples.csv", index=False)
    same = {"scene": "slab_large", "body": "slab", "regime": "large", "split": 1, "rmse_of_peak": 0.02}
    rows = [
        same | {"model": model, "setting": setting, "validation_rmse_of_peak": error, "online_p95_s": time}
        for (model, setting), (error, time) in SETTINGS.items()
    ]
    (folder / "results/tables").mkdir()
    table = pd.DataFrame(rows, columns=ACCURACY_VS_TIME.columns)
    table.to_csv(folder / "results/tables/accuracy_vs_time.csv", index=False)
    return folder


@pytest.fixture(scope="module")
def live(finished) -> LiveModels:
    """The models that answer presses of the slab."""
    return LiveModels(FinishedRun(finished / "config.yaml", finished / "results"), "slab_large")
