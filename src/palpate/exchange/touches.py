"""Questions of touches: a rigid instrument pushed to a depth, what then moves and the force it feels."""

from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from palpate.benchmark.settings import instrument_name
from palpate.benchmark.touch import Touch, TouchCase, Touched, TouchErrors, TouchTruth, patch_of, touch_errors
from palpate.benchmark.touch_measure import Touches, penetration
from palpate.benchmark.touch_truth import truth_of_touches
from palpate.bodies.body import Body
from palpate.effects.instrument import Instrument, Pose
from palpate.errors import InputError
from palpate.exchange import judging
from palpate.exchange.answers import Setting, Wanted
from palpate.exchange.asked_body import body_of, questions_on, with_law
from palpate.exchange.folder import Arrays, Questions
from palpate.files import read_table
from palpate.report.words import two_digits
from palpate.run.job import free_mb

OWN = TouchErrors._fields
TABLE, COLUMNS = "touch", ("force_error", "online_median_s")
"""The table of palpate's own models, and further columns that it must have."""
NUMBERS = {"force_n": Wanted(True), "force_before_n": Wanted(False), "area_m2": Wanted(False)}
"""What is asked beside displacements."""


def questions_of(body: Body, samples: np.ndarray, touches: Sequence[Touch]) -> Questions:
    """Return the questions of k touches by one instrument, without a truth; samples : (k,) their numbers."""
    instrument = touches[0].instrument
    if touches[0].grasps:
        raise InputError(f"{body.name}: a grasp has no shape that another engine could take; ask for an instrument.")
    loads: list[dict[str, Any]] = []
    for number, touch in zip(samples, touches, strict=True):
        pose = touch.pose(body)
        load = {"name": f"touch {int(number)}", "tip_m": pose.tip.tolist(), "axes": pose.axes.tolist()}
        loads.append(load | {"direction": touch.direction.tolist(), "depth_m": touch.depth_m})
    arrays = {"sample": np.asarray(samples, dtype=np.int64), "node": np.array([touch.node for touch in touches])}
    arrays["in_dent"] = np.array([patch_of(body, touch) for touch in touches])
    scene = f"{body.name}_{instrument_name(instrument)}"
    return questions_on(body, {"kind": "touch", "scene": scene, "instrument": asdict(instrument)}, loads, arrays)


def touches_in(questions: Questions, body: Body) -> list[Touch]:
    """Return the touches of ``questions`` on ``body``, with the poses of first touch that were asked about."""
    instrument, loads = Instrument(**questions.info["instrument"]), questions.arrays["loads"]
    placed = zip(*(loads[name] for name in ("node", "tip_m", "axes", "direction", "depth_m")), strict=True)
    return [
        Touch(instrument, int(node), direction, float(depth), {body: Pose(instrument, tip, axes)})
        for node, tip, axes, direction, depth in placed
    ]


class Judge(judging.Judge):
    kind, place = Touches, "tip_m"

    def __init__(self, questions: Questions, truth: Arrays):
        super().__init__(questions, truth)
        body, tool, self._truth = body_of(questions), Instrument(**questions.info["instrument"]), truth
        self._case, self._touches = TouchCase(body, tool, 0.0, 0), touches_in(questions, body)

    def further_errors(self, row: int, moved: np.ndarray, setting: Setting) -> dict[str, Any]:
        true_before, true_force = self._truth["force_n"][row]
        true = Touched(self.known[row], true_force, self._truth["area_m2"][row])
        force, force_before, area = (float(setting.numbers[name][row]) for name in NUMBERS)
        slope = (force - force_before) / (true_force - true_before) - 1.0
        answer = Touched(moved, force, area)
        columns = touch_errors(answer, true, self.loads["in_dent"][row], float(slope))._asdict()
        return columns | {"penetration_of_depth": penetration(self._case, self._touches[row], answer)}

    def slip(self, moved: np.ndarray, setting: Setting, there: np.ndarray) -> str:
        if mistake := super().slip(moved, setting, there):
            return mistake
        mistake = _force_slip(setting.numbers["force_n"][there], self._truth["force_n"][there, 1])
        return f"force_n {mistake}" if mistake else ""


def _force_slip(forces: np.ndarray, truth: np.ndarray) -> str:
    """Return a phrase on forces of the opposite sign or in another unit, if all are; another stiffness does neither."""
    if not len(forces):
        return ""
    if (forces < 0.0).all():
        return "is below 0 in every touch; give the force on the body along direction, positive as it pushes"
    ratio = forces / truth
    if (ratio > 300.0).all() and (ratio < 30000.0).all():
        return f"is {two_digits(float(np.median(ratio)))} times the truth, as if in mN; give N"
    return ""


def truth_arrays(truth: TouchTruth, rows: np.ndarray) -> Arrays:
    """Return the arrays of truth.npz for touches ``rows``; own errors are NaN where the truth is not believed."""
    arrays = judging.own_arrays(OWN, np.where(truth.believed[:, None], truth.own, np.nan)[rows])
    names = {"displacement": "displacement_m", "force": "force_n", "area": "area_m2"}
    kept = {name: value for name, value in vars(truth).items() if name not in ("sample", "own", "rejected")}
    return arrays | {names.get(name, name): value[rows] for name, value in kept.items()}


def find_truth(questions: Questions, law: str, progress: Callable = iter) -> Arrays:
    """Find the truth of every touch with the material's ``law``, one of palpate's, as ``make`` does."""
    body = with_law(body_of(questions), law)
    truth = truth_of_touches(body, touches_in(questions, body), progress, free_mb=free_mb())
    return truth_arrays(truth, np.arange(questions.count))


def wanted(questions: Questions) -> dict[str, Wanted]:
    """Return what is asked besides displacements: forces, and the area."""
    return NUMBERS


def asked_in(results: Path, questions: Questions) -> tuple[Path, bool]:
    """Return the file of a run's touches, and whether these are among them."""
    info, loads, asked = questions.info, questions.arrays["loads"], ["node", "depth_m"]
    file = results / "data" / info["body"] / "touch" / info["scene"].removeprefix(f"{info['body']}_") / "touches.csv"
    run_touches = read_table(file, ["sample", *asked]).set_index("sample").reindex(loads["sample"])
    return file, np.allclose(run_touches[asked], np.column_stack([loads[name] for name in asked]), rtol=1e-6)


def beside(rows: pd.DataFrame, questions: Questions) -> pd.DataFrame:
    """Return those of the ``rows`` of TABLE that answer these questions."""
    return rows
