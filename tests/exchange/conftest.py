"""A small block that has been pressed and whose truth is known, as ``make`` leaves it behind, and questions of it."""

from collections import namedtuple

import numpy as np
import pandas as pd
import pytest

from palpate.benchmark.database import asked_samples, fold_table, write
from palpate.benchmark.presses import LOAD_COLUMNS, oblique, samples_in
from palpate.benchmark.static_responses import assemble, press
from palpate.benchmark.truth import truth_of
from palpate.bodies.body_file import save
from palpate.bodies.contacts import contacts_by_area
from palpate.bodies.make_body import make_body
from palpate.exchange.ask import ask
from palpate.exchange.folder import read
from palpate.run.job import write_table
from palpate.run.settings import complete, read_settings
from palpate.stores import store

CONFIG = """
seed: 1
bodies:
  block:
    kind: box
    sizes_m: [0.12, 0.06, 0.05]
    divisions: [4, 2, 2]
    refinements: 1
    young_pa: 3000
    poisson: 0.3
    density_kg_m3: 1000
    anchors: {plane: {axis: z, side: min, depth_m: 0.001}}
regimes:
  large: {peak_of_size: 0.05, radius_m: 0.03}
tradeoff:
  bodies: [block]
  contacts: 10
  presses: [{magnitude: 1.0, tilt_degrees: 0}, {magnitude: 0.7, tilt_degrees: 30}]
"""
Run = namedtuple("Run", "config results settings body loads")


def files_of(results) -> dict:
    """What ``read_judged`` reads of the block's presses."""
    place = results / "data/block/large"
    files = {"body": place.parent / "body.h5", "samples": place / "samples.csv"}
    return files | {name: place / f"{name}.h5" for name in ("database", "truth")}


@pytest.fixture(scope="session")
def pressed(tmp_path_factory) -> Run:
    """Settings and results of a block: body, database, folds and truth of twenty presses at ten contacts."""
    folder = tmp_path_factory.mktemp("run")
    config = folder / "config.yaml"
    config.write_text(CONFIG)
    settings = complete(read_settings(config), config)
    body = make_body("block", settings.bodies["block"])
    block, place = settings.tradeoff, folder / "results/data/block/large"
    rows: list[list] = []
    for contact in contacts_by_area(body, block.contacts, 1):  # a tenth of Young's modulus at most, and no search
        for asked_press in block.presses:
            way = oblique(body.fine.normals[contact], asked_press.tilt_degrees, 1.0)
            newtons = asked_press.magnitude * 0.1 * 3000.0 * 0.5 * np.pi * 0.03**2
            rows.append([len(rows), int(contact), *(newtons * way), 0.03])
    loads = pd.DataFrame(rows, columns=LOAD_COLUMNS)
    fine, coarse = press(body, 1, loads, 1e-8), press(body, 0, loads, 1e-8)
    database = assemble(body, loads, fine, coarse, "abc")
    folds = fold_table(database, 1)
    asked, tested = asked_samples(folds, [1])
    save(body, place.parent / "body.h5")
    write(database, place / "database.h5")
    write_table(folds, place / "samples.csv")
    write_table(loads, place / "loads.csv")
    store(truth_of(body, samples_in(loads[loads["sample"].isin(asked)]), set(tested)), place / "truth.h5")
    return Run(config, folder / "results", settings, body, loads)


@pytest.fixture(scope="session")
def folder(pressed, tmp_path_factory):
    """The public questions of the block, written once."""
    out = tmp_path_factory.mktemp("asked") / "questions"
    ask(pressed.config, None, "block_large", None, out)
    return out


@pytest.fixture(scope="session")
def questions(folder):
    return read(folder)


@pytest.fixture
def answers(questions) -> dict[str, np.ndarray]:
    """A file's worth of answers: the truth, 30 %, 10 % and 1 % too small, with one failure of the first setting."""
    k, truth = questions.count, questions.truth["displacement_m"]
    found = {
        "digest": np.array(questions.digest), "engine": np.array("Elsewhere"), "version": np.array("1.2"),
        "hardware": np.array("a graphics card"), "law": np.array("corotational"),
        "settings": np.array(["coarse", "middle", "fine"]), "converged": np.array([False, False, True]),
    }  # fmt: skip
    for i, share in enumerate((0.7, 0.9, 0.99)):
        found |= {
            f"setting_{i}/displacement_m": share * truth,
            f"setting_{i}/seconds": np.full((k, 4), 0.001 * (i + 1)),
        }
        found |= {f"setting_{i}/preparation_s": np.array(0.5), f"setting_{i}/memory_mb": np.array(10.0)}
    found["setting_0/failed"] = np.arange(k) == 1
    found["setting_0/displacement_m"] = found["setting_0/displacement_m"].copy()
    found["setting_0/displacement_m"][1] = np.nan
    return found


@pytest.fixture(scope="session")
def rows_of_run(pressed):
    """Write accuracy_vs_time.csv of two made-up models beside the results."""
    from palpate.benchmark.press_measure import ACCURACY_VS_TIME

    row = dict.fromkeys(ACCURACY_VS_TIME.columns, 0.0)
    row |= {"scene": "block_large", "body": "block", "regime": "large", "split": 1, "samples": 2, "failures": 0}
    told = [("fem_p1", "level=0", 0.1, 0.002), ("fem_p2", "level=0", 0.0102, 0.01), ("zero", "default", 0.4, np.nan)]
    rows = [
        row | {"model": m, "setting": s, "rmse_of_peak": e, "patch_rms_of_peak": 2 * e, "online_median_s": t}
        for m, s, e, t in told
    ]
    (pressed.results / "tables").mkdir(exist_ok=True)
    pd.DataFrame(rows).to_csv(pressed.results / "tables/accuracy_vs_time.csv", index=False)
    return pressed.results
