"""Questions of touches: a rigid instrument pushed to a depth, what then moves and the force it feels."""

from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from palpate.benchmark.settings import instrument_name
from palpate.benchmark.touch import BEFORE, Touch
from palpate.benchmark.touch_truth import TouchErrors, TouchTruth, patch_of, truth_of_touches
from palpate.bodies.body import Body
from palpate.effects.instrument import Instrument, Pose
from palpate.errors import InputError
from palpate.exchange.answers import Wanted
from palpate.exchange.asked_body import body_arrays, body_info, body_of, refuse_sheet, with_law
from palpate.exchange.folder import Arrays, Questions
from palpate.exchange.readme import read_page
from palpate.run.job import free_mb

KIND = "touch"
OWN = TouchErrors._fields
NUMBERS = {"force_n": Wanted(True), "force_before_n": Wanted(False), "area_m2": Wanted(False)}
"""What is asked beside displacements."""
OF_TRUTH = ("force", "area", "pressure", "order", "force_order", "overlap", "least_det", "nodes", "edge_m", "seconds")


def questions_of(body: Body, samples: np.ndarray, touches: Sequence[Touch]) -> Questions:
    """Return the questions of k touches by one instrument, without a truth; samples : (k,) their numbers."""
    refuse_sheet(body)
    instrument = touches[0].instrument
    if touches[0].grasps:
        raise InputError(f"{body.name}: a grasp has no shape that another engine could take; ask for an instrument.")
    loads: list[dict[str, Any]] = []
    for number, touch in zip(samples, touches, strict=True):
        pose = touch.pose(body)
        told = {"name": f"touch {int(number)}", "tip_m": pose.tip.tolist(), "axes": pose.axes.tolist()}
        loads.append(told | {"direction": touch.direction.tolist(), "depth_m": touch.depth_m})
    arrays = body_arrays(body)
    arrays["loads"] = {name: np.array([load[name] for load in loads]) for name in loads[0] if name != "name"}
    arrays["loads"]["sample"] = np.asarray(samples, dtype=np.int64)
    arrays["loads"]["node"] = np.array([touch.node for touch in touches])
    arrays["loads"]["in_dent"] = np.array([patch_of(body, touch) for touch in touches])
    scene = f"{body.name}_{instrument_name(instrument)}"
    told = asdict(instrument)
    return Questions({"kind": KIND, "scene": scene, "instrument": told, **body_info(body), "loads": loads}, arrays)


def touches_in(questions: Questions, body: Body) -> list[Touch]:
    """Return the touches of ``questions`` on ``body``, with the poses of first touch that were asked about."""
    instrument, loads = Instrument(**questions.info["instrument"]), questions.arrays["loads"]
    found = []
    for node, tip, axes, way, depth in zip(*(loads[name] for name in PLACED), strict=True):
        found.append(Touch(instrument, int(node), way, float(depth), {body: Pose(instrument, tip, axes)}))
    return found


PLACED = ("node", "tip_m", "axes", "direction", "depth_m")


def truth_arrays(truth: TouchTruth, rows: np.ndarray) -> Arrays:
    """Return the arrays of truth.npz for the touches ``rows``; its own errors are NaN where it is not believed."""
    own = np.where(truth.believed[:, None], truth.own, np.nan)[rows]
    found = {f"own_{name}": np.ascontiguousarray(column) for name, column in zip(OWN, own.T, strict=True)}
    names = {"displacement": "displacement_m", "force": "force_n", "area": "area_m2"}
    return found | {names.get(name, name): getattr(truth, name)[rows] for name in ("displacement", *OF_TRUTH)}


def find_truth(questions: Questions, law: str, progress: Callable = iter) -> Arrays:
    """Find the truth of every touch with the material's ``law``, one of palpate's, as ``make`` does."""
    body = with_law(body_of(questions), law)
    found = truth_of_touches(body, touches_in(questions, body), progress, free_mb=free_mb())
    return truth_arrays(found, np.arange(questions.count))


def page(questions: Questions) -> dict[str, str]:
    """Return what README.md says of touches, by its places."""
    told = questions.info["instrument"]
    shape = {
        "sphere": f"a ball of radius R = {told['radius_m']:g} m; its centre is at `tip_m` + R · `axes[2]`",
        "capsule": f"all within R = {told['radius_m']:g} m of a segment {told['length_m']:g} m long, which lies along "
        "`axes[0]` with its middle at `tip_m` + R · `axes[2]`",
        "punch": f"a cylinder of radius R = {told['radius_m']:g} m with the axis `axes[2]`, whose flat end is at "
        f"`tip_m`, rounded with a radius of {told['edge_m']:g} m; it has no other end",
    }[told["kind"]]
    contact = "what it touches keeps its place on it" if told["sticks"] else "there is no friction"
    text = read_page("touch.md").substitute(count=questions.count, shape=shape, contact=contact, before=BEFORE)
    example = read_page("touch_example.txt").substitute(law=questions.info["law"])
    scored = (
        "The root mean square over the points of the length of the error, over the largest true displacement (the "
        "peak); the same in the dent; the relative error of the force, of its slope over the last fifth of the depth, "
        "and of the area; how far asked points are inside the instrument; failures; times and memory."
    )
    answers = (
        "| `setting_0/displacement_m` | (k, p, 3) | displacement of each asked point at the whole depth, from rest |\n"
        "| `setting_0/nodes_m`, `setting_0/triangles` | (n, 3), (t, 3) | only for a mesh of your own, see below |\n"
        "| `setting_0/force_n` | (k,) | the instrument's force on the body along `direction`, positive as it pushes |\n"
        f"| `setting_0/force_before_n` | (k,) | may be left out: the same at {BEFORE:g} of the depth |\n"
        "| `setting_0/area_m2` | (k,) | may be left out: area that touches |"
    )
    return {"asked": text, "example": example.rstrip(), "scored": scored, "question": "touch", "answer_rows": answers}
