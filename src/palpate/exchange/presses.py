"""Questions of presses: a pressure over a disc, and the displacement that it causes."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from palpate.benchmark.accuracy import TruthErrors, patch_nodes
from palpate.benchmark.judge import read_judged
from palpate.benchmark.load import FORCES
from palpate.benchmark.measure import Presses
from palpate.benchmark.settings import FitOptions
from palpate.benchmark.truth import truth_of
from palpate.bodies.body import Body
from palpate.effects.patch_load import nodal_load, patch_at
from palpate.exchange import judging
from palpate.exchange.answers import Wanted
from palpate.exchange.asked_body import body_of, questions_on, with_law
from palpate.exchange.folder import Arrays, Questions
from palpate.files import read_table

OWN = TruthErrors._fields
TABLE, COLUMNS = "accuracy_vs_time", ("split", "online_median_s")
"""The table of palpate's own models, and further columns that it must have."""
ASKED = ["contact", *FORCES]


def questions_of(
    body: Body, regime: str, radius_m: float, samples: np.ndarray, contacts: np.ndarray, forces: np.ndarray
) -> Questions:
    """Return the questions of k presses, without a truth; samples, contacts : (k,), forces : (k, 3) [N]."""
    loads: list[dict[str, Any]] = []
    for number, contact, force in zip(samples, contacts, forces, strict=True):
        patch = patch_at(body, int(contact), radius_m)
        told = {"name": f"press {int(number)}", "place_m": patch.center_m.tolist(), "normal": patch.normal.tolist()}
        loads.append(told | {"radius_m": patch.radius_m, "force_n": np.asarray(force, dtype=float).tolist()})
    # contacts are nodes of the coarse mesh, and of all finer ones
    more = {"sample": np.asarray(samples, dtype=np.int64), "node": np.asarray(contacts, dtype=np.int64)}
    more["in_dent"] = np.array([patch_nodes(body.fine, int(each), radius_m) for each in contacts])
    for level in range(len(body.levels)):
        nodal = [nodal_load(body, level, int(c), f, radius_m) for c, f in zip(contacts, forces, strict=True)]
        more[f"level_{level}/nodal_force_n"] = np.array(nodal)
    return questions_on(body, {"kind": "press", "scene": f"{body.name}_{regime}", "regime": regime}, loads, more)


class Judge(judging.Judge):
    kind, answer_suffices = Presses, True

    def __init__(self, questions: Questions, truth: Arrays):
        super().__init__(questions, truth, ("regime",), "place_m")
        self.labels["split"] = 1

    def sample(self, row: int) -> dict[str, Any]:
        return {"side": "test", "sample": self.loads["sample"][row], "contact": self.loads["node"][row]}


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
    asked = judge.numbers[rows], judge.samples.contact[rows], judge.samples.force[rows]
    questions = questions_of(case.body, regime, radius_m, *asked)
    truth = truth_arrays(judge.truth[rows], judge.own[rows], judge.own_seconds[rows])
    return case.body, replace(questions, truth=truth)


def find_truth(questions: Questions, law: str, progress: Callable = iter) -> Arrays:
    """Find the truth of every press with the material's ``law``, one of palpate's, as ``make`` does."""
    body, loads = with_law(body_of(questions), law), questions.arrays["loads"]
    table = pd.DataFrame(loads["force_n"], columns=FORCES)
    table = table.assign(sample=loads["sample"], contact=loads["node"], radius_m=loads["radius_m"])
    found = truth_of(body, table, set(loads["sample"].tolist()), progress)
    own = np.where(found.believed[:, None], found.own, np.nan)
    return truth_arrays(found.displacement, own, found.seconds)


def wanted(questions: Questions) -> dict[str, Wanted]:
    """Return what is asked beside displacements: nothing."""
    return {}


def asked_in(results: Path, questions: Questions) -> tuple[Path, bool]:
    """Return the file of a run's presses, and whether these are among them."""
    info, loads = questions.info, questions.arrays["loads"]
    place = results / "data" / info["body"] / info["regime"] / "loads.csv"
    known = read_table(place, ["sample", *ASKED]).set_index("sample").reindex(loads["sample"])
    return place, np.allclose(known[ASKED], np.column_stack([loads["node"], loads["force_n"]]), rtol=1e-6)


def beside(rows: pd.DataFrame, questions: Questions) -> pd.DataFrame:
    """Return those of the ``rows`` of TABLE that answer these questions."""
    rows = rows[rows["split"] == rows["split"].min()]
    return rows[rows["engine"].isna()] if "engine" in rows else rows
