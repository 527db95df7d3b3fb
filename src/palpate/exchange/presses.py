"""Questions of presses: a pressure over a disc, and the displacement that it causes."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from palpate.benchmark.accuracy import TruthErrors, patch_nodes
from palpate.benchmark.database import database_of
from palpate.benchmark.judge import Judge, read_judged
from palpate.benchmark.settings import FitOptions
from palpate.benchmark.truth import truth_of
from palpate.bodies.body import Body
from palpate.effects.patch_load import nodal_load, patch_at
from palpate.errors import InputError
from palpate.exchange.asked_body import body_arrays, body_info, body_of, refuse_sheet, with_law
from palpate.exchange.folder import Arrays, Questions
from palpate.exchange.readme import read_page

KIND = "press"
OWN = TruthErrors._fields


def questions_of(
    body: Body, regime: str, radius_m: float, samples: np.ndarray, contacts: np.ndarray, forces: np.ndarray
) -> Questions:
    """Return the questions of k presses, without a truth; samples, contacts : (k,), forces : (k, 3) [N]."""
    refuse_sheet(body)
    loads: list[dict[str, Any]] = []
    for number, contact, force in zip(samples, contacts, forces, strict=True):
        patch = patch_at(body, int(contact), radius_m)
        told = {"name": f"press {int(number)}", "place_m": patch.center_m.tolist(), "normal": patch.normal.tolist()}
        loads.append(told | {"radius_m": patch.radius_m, "force_n": np.asarray(force, dtype=float).tolist()})
    arrays = body_arrays(body)
    arrays["loads"] = {name: np.array([load[name] for load in loads]) for name in loads[0] if name != "name"}
    arrays["loads"]["sample"] = np.asarray(samples, dtype=np.int64)
    # contacts are nodes of the coarse mesh, and of all finer ones
    arrays["loads"]["node"] = np.asarray(contacts, dtype=np.int64)
    arrays["loads"]["in_dent"] = np.array([patch_nodes(body.fine, int(each), radius_m) for each in contacts])
    for level in range(len(body.levels)):
        nodal = [nodal_load(body, level, int(c), f, radius_m) for c, f in zip(contacts, forces, strict=True)]
        arrays["loads"][f"level_{level}/nodal_force_n"] = np.array(nodal)
    info = {"kind": KIND, "scene": f"{body.name}_{regime}", "regime": regime, **body_info(body), "loads": loads}
    return Questions(info, arrays)


def truth_arrays(displacement: np.ndarray, own: np.ndarray, seconds: np.ndarray) -> Arrays:
    """Return the arrays of truth.npz.

    displacement : (k, p, 3) [m]; own : (k, len(TruthErrors)) its own errors, NaN where it is not believed
    seconds : (k,) what finding it took
    """
    errors = {f"own_{name}": np.ascontiguousarray(column) for name, column in zip(OWN, own.T, strict=True)}
    return {"displacement_m": displacement, "seconds": seconds, **errors}


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


def judge_of(questions: Questions, truth: Arrays) -> tuple[Judge, np.ndarray]:
    """Return what judges answers, as it judges those of palpate's own models, and which questions (rows,) it judges.

    They are those whose truth is believed; where none is, those that have an answer on the finest level.
    """
    own, moved = np.stack([truth[f"own_{name}"] for name in OWN], axis=1), truth["displacement_m"]
    answered = np.isfinite(moved).all(axis=(1, 2))
    believed = answered & np.isfinite(own).all(axis=1)
    rows = np.flatnonzero(believed if believed.any() else answered)
    if not len(rows):
        raise InputError(f"{questions.info['scene']}: no press has a truth; press less hard, and ask anew.")
    loads, body = questions.arrays["loads"], body_of(questions)
    still = [np.zeros((len(rows), len(mesh.nodes), 3)) for mesh in (body.coarse, body.fine)]
    samples = database_of(body, loads["node"][rows], loads["force_n"][rows], *still)
    known = moved[rows], own[rows], truth["seconds"][rows]
    judge = Judge(1, loads["sample"][rows], np.full(len(rows), "test"), samples, *known, loads["in_dent"][rows])
    return judge, rows


def find_truth(questions: Questions, law: str, progress: Callable = iter) -> Arrays:
    """Find the truth of every press with the material's ``law``, one of palpate's, as ``make`` does."""
    body, loads = with_law(body_of(questions), law), questions.arrays["loads"]
    table = pd.DataFrame(loads["force_n"], columns=["force_x_n", "force_y_n", "force_z_n"])
    table = table.assign(sample=loads["sample"], contact=loads["node"], radius_m=loads["radius_m"])
    found = truth_of(body, table, set(loads["sample"].tolist()), progress)
    own = np.where(found.believed[:, None], found.own, np.nan)
    return truth_arrays(found.displacement, own, found.seconds)


def page(questions: Questions) -> dict[str, str]:
    """Return what README.md says of presses, by its places."""
    text = read_page("press.md").substitute(disc=read_page("disc.md").substitute().rstrip())
    example = read_page("press_example.txt").substitute(law=questions.info["law"])
    scored = (
        "The root mean square over the points of the length of the error, over the largest true displacement (the "
        "peak); the same at the points in the dent; failures; times and memory. Means are over all questions that have "
        "an answer. Each error has the truth's own as a floor: below it nothing can be told."
    )
    return {"asked": text, "example": example.rstrip(), "scored": scored, "question": "press", "answer_rows": ANSWER}


ANSWER = (
    "| `setting_0/displacement_m` | (k, p, 3) | displacement of each asked point under each load, from rest |\n"
    "| `setting_0/nodes_m`, `setting_0/triangles` | (n, 3), (t, 3) | only for a mesh of your own, see below |"
)
