"""Questions of presses: a pressure over a disc, and the displacement that it causes."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from palpate.benchmark.accuracy import TruthErrors, read_judged
from palpate.benchmark.load import loads_of
from palpate.benchmark.press_measure import Presses
from palpate.benchmark.presses import FORCES, Sample
from palpate.benchmark.settings import FitOptions
from palpate.benchmark.truth import truth_of
from palpate.bodies.body import Body
from palpate.exchange import judging
from palpate.exchange.answers import Wanted
from palpate.exchange.asked_body import body_of, questions_on, with_law
from palpate.exchange.folder import Arrays, Questions
from palpate.files import read_table

OWN = TruthErrors._fields
TABLE, COLUMNS = "accuracy_vs_time", ("split", "online_median_s")
"""The table of palpate's own models, and further columns that it must have."""
ASKED = ["contact", *FORCES]


def questions_of(body: Body, regime: str, samples: Sequence[Sample]) -> Questions:
    """Return the questions of presses at one contact each, without a truth."""
    loads: list[dict[str, Any]] = []
    for sample in samples:
        [patch], (_, force) = sample.patches(body), sample.load.single()
        place, normal = patch.center_m.tolist(), patch.normal.tolist()
        load = {"name": f"press {sample.number}", "place_m": place, "normal": normal}
        loads.append(load | {"radius_m": patch.radius_m, "force_n": force.tolist()})
    arrays = {"sample": np.array([sample.number for sample in samples])}
    # contacts are nodes of the coarse mesh, and of all finer ones
    arrays["node"] = np.array([sample.load.single()[0] for sample in samples])
    arrays["in_dent"] = np.array([sample.pressed(body) for sample in samples])
    for level in range(len(body.levels)):
        arrays[f"level_{level}/nodal_force_n"] = np.array([sample.nodal(body, level) for sample in samples])
    return questions_on(body, {"kind": "press", "scene": f"{body.name}_{regime}", "regime": regime}, loads, arrays)


class Judge(judging.Judge):
    kind, named, place, answer_suffices = Presses, {"side": "test"}, "place_m", True


def truth_arrays(displacement: np.ndarray, own: np.ndarray, seconds: np.ndarray) -> Arrays:
    """Return the arrays of truth.npz.

    displacement : (k, p, 3) [m]; own : (k, len(TruthErrors)) its own errors, NaN where it is not believed
    seconds : (k,) what finding it took
    """
    return {"displacement_m": displacement, "seconds": seconds, **judging.own_arrays(OWN, own)}


def of_run(files: Mapping[str, Any], regime: str, split: int, radius_m: float) -> tuple[Body, Questions]:
    """Return a body and the questions of the test presses of ``split`` with their truth, as a run has them.

    files : body, database, samples and truth
    """
    case, judge = read_judged(files, regime, split, radius_m, FitOptions(), 1e-8)  # nothing learns
    rows = np.flatnonzero(judge.side == "test")
    pressed = judge.samples.take(rows)
    loads = zip(judge.numbers[rows], loads_of(pressed.contact, pressed.force), strict=True)
    questions = questions_of(case.body, regime, [Sample(int(number), load, radius_m) for number, load in loads])
    truth = truth_arrays(judge.truth[rows], judge.own[rows], judge.own_seconds[rows])
    return case.body, replace(questions, truth=truth)


def find_truth(questions: Questions, law: str, progress: Callable = iter) -> Arrays:
    """Find the truth of every press with the material's ``law``, one of palpate's, as ``make`` does."""
    body, loads = with_law(body_of(questions), law), questions.arrays["loads"]
    asked = zip(loads["sample"].tolist(), loads_of(loads["node"], loads["force_n"]), loads["radius_m"], strict=True)
    truth = truth_of(body, [Sample(*each) for each in asked], set(loads["sample"].tolist()), progress)
    own = np.where(truth.believed[:, None], truth.own, np.nan)
    return truth_arrays(truth.displacement, own, truth.seconds)


def wanted(questions: Questions) -> dict[str, Wanted]:
    """Return what is asked besides displacements: nothing."""
    return {}


def asked_in(results: Path, questions: Questions) -> tuple[Path, bool]:
    """Return the file of a run's presses, and whether those of the questions are among them."""
    info, loads = questions.info, questions.arrays["loads"]
    file = results / "data" / info["body"] / info["regime"] / "loads.csv"
    run_presses = read_table(file, ["sample", *ASKED]).set_index("sample").reindex(loads["sample"])
    return file, np.allclose(run_presses[ASKED], np.column_stack([loads["node"], loads["force_n"]]), rtol=1e-6)


def beside(rows: pd.DataFrame, questions: Questions) -> pd.DataFrame:
    """Return those of the ``rows`` of TABLE that answer these questions."""
    rows = rows[rows["split"] == rows["split"].min()]
    return rows[rows["engine"].isna()] if "engine" in rows else rows
