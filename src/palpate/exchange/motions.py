"""Questions of motions: a body under weight, pushes and instruments over time, and where its surface is at instants."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pandas as pd
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from palpate.benchmark.accuracy import TruthErrors
from palpate.benchmark.measuring import Kind
from palpate.benchmark.motion_truth import ForceErrors, MotionTruth, force_errors, motion_truth, pressed_nodes
from palpate.benchmark.moving_scene import MovingScene
from palpate.benchmark.presses import oblique
from palpate.bodies.body import Body
from palpate.bodies.contacts import contacts_by_area
from palpate.bodies.particles import particles_of
from palpate.collision.contact.instrument_contact import instruments_of
from palpate.effects.patch_load import spread
from palpate.effects.push import disc, factor
from palpate.effects.settings import Gravity, Loads, Push, Rayleigh
from palpate.errors import InputError
from palpate.exchange import judging
from palpate.exchange.answers import Setting, Wanted
from palpate.exchange.asked_body import body_arrays, body_info, body_of, refuse_sheet, with_law
from palpate.exchange.folder import Arrays, Questions
from palpate.exchange.suspects import over_time, slip
from palpate.setting_types import plain
from palpate.stores import stored

OWN = TruthErrors._fields
TABLE, COLUMNS = "dynamic_accuracy", ("failures", "force_rms_of_peak", "real_time_factor")
"""The table of palpate's own models, and further columns that it must have."""
FORCE = "force_n"
COURSE = ("radius_m", "force_n", "start_s", "press_s", "hold_s", "release_s")
LARGEST_TILT, LARGEST_TURN = 30.0, 30.0
"""Of drawn motions: degrees between a push and the inward normal, and by which weight is turned."""


def questions_of(scenes: Sequence[MovingScene], found_by: Mapping[str, int]) -> Questions:
    """Return the questions of motions of one scene that differ in their loads, without a truth.

    found_by : ``levels`` and ``steps_per_frame`` with which the truth is found
    """
    scene, body = scenes[0], scenes[0].body
    refuse_sheet(body)
    if body.densities is not None:
        raise InputError(f"bodies.{body.name} has the masses of its CT, which questions do not tell; ask for another.")
    placed = [each.placed_loads() for each in scenes]
    loads = [{"name": f"motion {number}", **_described(blocks)} for number, blocks in enumerate(placed)]
    instants = (scene.duration_s * np.arange(1, scene.frames + 1) / scene.frames).round(12)
    arrays = body_arrays(body)
    arrays["loads"] = {"in_dent": np.array([_pressed(body, each, scene.duration_s) for each in placed])}
    pushes = [each.pushes for each in placed]
    for level, mesh in enumerate(body.levels):
        arrays["loads"][f"level_{level}/mass_kg"] = particles_of(body, level, surface=False).masses
        if pushes[0]:
            forces = [[spread(mesh, disc(p), np.array(p.force_n, dtype=float)) for p in each] for each in pushes]
            arrays["loads"][f"level_{level}/nodal_force_n"] = np.array(forces)
    if pushes[0]:
        arrays["loads"]["factor"] = np.array([[[factor(p, t) for t in instants] for p in each] for each in pushes])
    info = {"kind": "motion", "scene": scene.name, "duration_s": scene.duration_s, "instants_s": instants.tolist()}
    info |= {"damping": dict(scene.rayleigh), "found_by": dict(found_by), **body_info(body), "loads": loads}
    return Questions(info, arrays)


def _described(acts: Loads) -> dict[str, Any]:
    """Return the description of loads in questions.json: weight, pushes and instruments."""
    blocks: dict[str, Any] = {}
    if acts.gravity:
        blocks["gravity_m_s2"] = acts.acceleration_m_s2
    if acts.push:
        blocks["pushes"] = [
            {"place_m": each.at_m, "normal": each.normal, **{name: getattr(each, name) for name in COURSE}}
            for each in acts.pushes
        ]
    if contact := acts.contact:
        blocks["instruments"] = [
            {name: value for name, value in plain(each).items() if name != "name"} for each in contact.instruments
        ]
        blocks |= {"friction": contact.friction, "slip_m_s": contact.slip_m_s}
    return blocks


def _loads(described: Mapping[str, Any]) -> Loads:
    """Return the loads that ``_described`` describes."""
    blocks: dict[str, Any] = {}
    if "gravity_m_s2" in described:
        blocks["gravity"] = {"acceleration_m_s2": described["gravity_m_s2"]}
    if "pushes" in described:
        pushes = [{"at_m": each["place_m"], **each} for each in described["pushes"]]
        blocks["push"] = {"loads": [{name: each[name] for name in each if name != "place_m"} for each in pushes]}
    if "instruments" in described:
        blocks["contact"] = {name: described[name] for name in ("instruments", "friction", "slip_m_s")}
    return Loads(**blocks)


def _pressed(body: Body, acts: Loads, duration_s: float) -> np.ndarray:
    """Mark the asked points that are pushed, or near where instruments are at some time, (p,) bool; else all of them.

    Near is within an instrument's radius of a point at rest that it covers.
    """
    if not acts.contact:
        return pressed_nodes(body, acts)
    points, swept = body.fine.nodes[body.fine.surface], np.zeros(len(body.fine.surface), dtype=bool)
    tools = instruments_of(body, acts.contact).obstacles
    for tool in tools:
        turns_s = tool.times_s if len(tool.times_s) else np.zeros(1)
        for t in np.union1d(np.linspace(0.0, duration_s, 201), turns_s[turns_s <= duration_s]):
            swept |= tool.pose(t).gaps(points)[0] <= 0.0
    if not swept.any():
        return ~swept
    return cKDTree(points[swept]).query(points)[0] <= max(tool.radius_m for tool in tools)


def drawn(scene: MovingScene, seed: int) -> MovingScene:
    """Return a scene with random loads: its pushes at other places and oblique, its weight turned.

    InputError for instruments, whose paths are made for the places that they touch.
    """
    if scene.loads.contact:
        raise InputError(f"--seed moves pushes and turns weight, and {scene.name} is touched; leave --seed out.")
    rng, gravity, push, fine = np.random.default_rng(seed), scene.loads.gravity, scene.loads.push, scene.body.fine
    if push:
        pushes = []
        for each, contact in zip(push.loads, contacts_by_area(scene.body, len(push.loads), seed), strict=True):
            direction = oblique(fine.normals[contact], rng.uniform(0.0, LARGEST_TILT), rng.uniform(0.0, 2.0 * np.pi))
            force = np.linalg.norm(each.force_n) * direction
            pushes.append(each.but(at_m=fine.nodes[contact].tolist(), force_n=force.tolist()))
        push = Push(loads=pushes)
    if gravity:
        axis = rng.normal(size=3)
        turn = Rotation.from_rotvec(np.radians(rng.uniform(0.0, LARGEST_TURN)) * axis / np.linalg.norm(axis))
        gravity = Gravity(acceleration_m_s2=turn.apply(gravity.acceleration_m_s2).tolist())
    return replace(scene, loads=scene.loads.but(gravity=gravity, push=push))


class _Motions(Kind):
    errors = (*OWN, *ForceErrors._fields, "real_time_factor")
    spread = ("rmse_of_peak",)


class Judge(judging.Judge):
    kind = _Motions

    def __init__(self, questions: Questions, truth: Arrays):
        super().__init__(questions, truth)
        self._force, self._duration_s, self._frames = truth[FORCE], questions.info["duration_s"], questions.frames[0]

    def errors(self, row: int, moved: np.ndarray) -> dict[str, Any]:
        columns = super().errors(row, moved)
        if self.loads["in_dent"][row].all():  # nothing is pressed, and there is no dent
            columns |= dict.fromkeys(("patch_rms_of_peak", "patch_max_of_peak"), np.nan)
        return columns

    def further_errors(self, row: int, moved: np.ndarray, setting: Setting) -> dict[str, Any]:
        columns = {"real_time_factor": float(np.nanmedian(setting.seconds[row])) / self._duration_s}
        if FORCE in setting.numbers:
            columns |= force_errors(setting.numbers[FORCE][row], self._force[row])._asdict()
        return columns

    def slip(self, moved: np.ndarray, setting: Setting, there: np.ndarray) -> str:
        for row in there:
            mistake = slip(moved[row], self.known[row], self.asked["points_m"], self.asked["triangles"], None)
            if mistake := mistake or over_time(moved[row], self.known[row], self._duration_s / self._frames):
                return f"displacement_m {mistake}"
        return ""


def truth_arrays(truths: Sequence[MotionTruth]) -> Arrays:
    """Return the arrays of truth.npz; own errors are NaN where the truth is not believed."""
    own = np.array([np.full(len(OWN), np.nan) if each.rejected else each.own[3] for each in truths])
    arrays = {"own_force_rms_of_peak": np.array([each.own_force for each in truths])}
    arrays |= {"displacement_m": np.array([each.displacement for each in truths])}
    arrays |= {FORCE: np.array([each.force for each in truths]), "seconds": np.array([each.spent_s for each in truths])}
    return arrays | judging.own_arrays(OWN, own)


def find_truth(questions: Questions, law: str, progress: Callable = iter) -> Arrays:
    """Find the truth of every motion with the material's ``law``, one of palpate's, as ``make`` does."""
    info, body = questions.info, with_law(body_of(questions), law)
    frames, by = len(info["instants_s"]), info["found_by"]
    times = Rayleigh(**info["damping"]), info["duration_s"], frames, by["steps_per_frame"] * frames, by["levels"]
    return truth_arrays([motion_truth(body, _loads(each), *times, progress) for each in info["loads"]])


def wanted(questions: Questions) -> dict[str, Wanted]:
    """Return what is asked besides displacements: the force of instruments, if there are any."""
    tools = len(questions.info["loads"][0].get("instruments", []))
    return {FORCE: Wanted(True, (len(questions.info["instants_s"]), tools, 3))} if tools else {}


def asked_in(results: FilePath, questions: Questions) -> tuple[FilePath, bool]:
    """Return the file of a run's motion, and whether its truth is that of these questions."""
    file = results / "data/dynamic" / questions.info["scene"] / "truth.h5"
    run_truth = stored(MotionTruth, file).displacement if file.is_file() else np.empty(0)
    asked = None if questions.truth is None else questions.truth["displacement_m"][0]
    same = asked is not None and run_truth.shape == asked.shape and np.allclose(run_truth, asked, rtol=1e-6, atol=0.0)
    return file, same


def beside(rows: pd.DataFrame, questions: Questions) -> pd.DataFrame:
    """Return those of the ``rows`` of TABLE that answer these questions."""
    return rows.assign(online_median_s=rows["real_time_factor"] * questions.info["duration_s"], samples=1)
