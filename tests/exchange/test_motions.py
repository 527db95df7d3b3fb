"""Motions asked elsewhere: a script that knows the folder alone is scored as the same elements inside."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from palpate.benchmark.accuracy import errors
from palpate.benchmark.motion_truth import force_errors, motion_truth
from palpate.benchmark.moving_scene import MovingScene
from palpate.bodies.body_file import save
from palpate.bodies.make_body import make_body
from palpate.effects.settings import Ball, Loads
from palpate.errors import InputError
from palpate.exchange import motions
from palpate.exchange.ask import ask, readme
from palpate.exchange.folder import packed, read
from palpate.exchange.judging import score_answers
from palpate.exchange.suspects import over_time
from palpate.run.settings import complete, read_settings
from palpate.stores import store
from palpate.studies.dynamic.compared_scene import ComparedScene

CONFIG = """
seed: 1
bodies:
  bar:
    kind: box
    sizes_m: [0.1, 0.04, 0.04]
    divisions: [3, 1, 1]
    refinements: 0
    young_pa: 20000
    poisson: 0.3
    density_kg_m3: 1000
    anchors: {plane: {axis: x, side: min, depth_m: 0.001}}
scenes:
  poke:
    body: bar
    gravity: {acceleration_m_s2: [0, 0, -4]}
    push:
      loads:
        - at_m: [0.1, 0.02, 0.04]
          force_n: [0, 0.1, -0.2]
          radius_m: 0.03
          start_s: 0.0
          press_s: 0.05
          hold_s: 0.02
          release_s: 0.04
    rayleigh: {mass_1_s: 2.0, stiffness_s: 0.01}
    integrator: bdf2
    step_s: 0.01
    duration_s: 0.16
dynamic:
  frames: 4
  scenes:
    poke: {truth: {levels: 3, steps_per_frame: 4}}
"""


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Settings and results of a bar that is poked under its weight, as ``make`` leaves them behind."""
    folder = tmp_path_factory.mktemp("run")
    config = folder / "config.yaml"
    config.write_text(CONFIG)
    settings = complete(read_settings(config), config)
    body = make_body("bar", settings.bodies["bar"])
    scene = ComparedScene.of(settings.scenes["poke"].but(name="poke"), body, 0.16, 4)
    truth = motion_truth(scene.body, scene.placed_loads(), scene.rayleigh, 0.16, 4, 16)
    save(body, folder / "results/data/bar/body.h5")
    (folder / "results/data/dynamic/poke").mkdir(parents=True)
    store(truth, folder / "results/data/dynamic/poke/truth.h5")
    return SimpleNamespace(config=config, results=folder / "results", scene=scene, truth=truth)


@pytest.fixture(scope="module")
def folder(run, tmp_path_factory):
    out = tmp_path_factory.mktemp("asked") / "questions"
    ask(run.config, None, "poke", None, out)
    return out


@pytest.fixture(scope="module")
def answered(run, folder, tmp_path_factory):
    """What linear elements inside answer, of which the last have a mesh of their own, which is that of the points."""
    questions, runs = read(folder), ((0, 4), (0, 16), (1, 8))
    answers = {"digest": questions.digest, "engine": "elements", "version": "1", "hardware": "here"}
    answers |= {"law": "corotational", "settings": [f"{runs}" for runs in runs], "converged": [False, True, False]}
    for i, (level, steps) in enumerate(runs):
        moved, _ = run.scene.move(run.scene.fem(steps), level)
        answers |= {f"setting_{i}/displacement_m": moved[None], f"setting_{i}/seconds": [0.32]}
        answers |= {f"setting_{i}/preparation_s": 0.1}
    asked = questions.arrays["asked"]
    answers |= {"setting_2/nodes_m": asked["points_m"], "setting_2/triangles": asked["triangles"]}
    path = tmp_path_factory.mktemp("answered") / "answers.npz"
    np.savez(path, **answers)
    return path


def test_elements_are_scored_as_inside(run, folder, answered):
    questions = read(folder)
    found = score_answers(answered, questions, questions.truth).settings
    with np.load(answered) as file:
        moved = [file[f"setting_{i}/displacement_m"] for i in range(3)]
    for row, each in zip(found.itertuples(), moved, strict=True):
        inside = errors(each.reshape(-1, 3), run.truth.displacement.reshape(-1, 3))
        for name in ("rmse_m", "rmse_of_peak", "p95_of_peak", "max_of_peak"):
            assert getattr(row, name) == pytest.approx(getattr(inside, name), rel=1e-7), (row.setting, name)
    assert (found["failures"] == 0).all() and found["real_time_factor"].to_numpy() == pytest.approx(2.0)
    assert (found["patch_rms_of_peak"] > found["rmse_of_peak"]).all()  # the tip, which moves most


def test_the_folder_says_what_acts(run, folder):
    questions, told = read(folder), json.loads((folder / "questions.json").read_text())
    load, arrays = told["loads"][0], questions.arrays["loads"]
    assert told["instants_s"] == pytest.approx([0.04, 0.08, 0.12, 0.16]) and questions.count == 1
    assert told["damping"] == {"mass_1_s": 2.0, "stiffness_s": 0.01}
    assert np.array_equal(questions.truth["displacement_m"][0], run.truth.displacement)
    assert questions.truth["own_rmse_of_peak"][0] == run.truth.own_error
    volume, push, moments = 0.1 * 0.04 * 0.04, load["pushes"][0], []
    for level in range(2):
        assert arrays[f"level_{level}/mass_kg"].sum() == pytest.approx(1000.0 * volume)
        assert arrays[f"level_{level}/nodal_force_n"][0, 0].sum(axis=0) == pytest.approx([0.0, 0.1, -0.2])
        nodes = run.scene.body.levels[level].nodes
        assert arrays[f"level_{level}/mass_kg"] @ nodes == pytest.approx(1000.0 * volume * np.array([0.05, 0.02, 0.02]))
        moments.append(nodes.T @ arrays[f"level_{level}/nodal_force_n"][0, 0])
    assert np.allclose(*moments, atol=1e-12)  # any linear displacement takes the same work on both
    # 0.8 of the rise, the whole, a half of the fall and nothing
    assert arrays["factor"][0, 0] == pytest.approx([0.896, 0.84375, 0.0, 0.0]) and push["hold_s"] == 0.02
    dent = np.linalg.norm(questions.points - push["place_m"], axis=1) <= 0.03
    assert arrays["in_dent"][0].any() and (dent | ~arrays["in_dent"][0]).all()


def test_the_truth_is_found_again_from_the_folder_alone(run, folder):
    found = motions.find_truth(read(folder), "corotational")
    assert found["displacement_m"][0] == pytest.approx(run.truth.displacement, abs=1e-12)
    assert found["own_rmse_of_peak"][0] == pytest.approx(run.truth.own_error, rel=1e-6)


def test_a_private_motion_is_another_of_the_same_size(run, tmp_path):
    ask(run.config, None, "poke", 7, tmp_path / "private")
    found = read(tmp_path / "private")
    load = found.info["loads"][0]
    assert found.truth is None and np.linalg.norm(load["gravity_m_s2"]) == pytest.approx(4.0)
    push = load["pushes"][0]
    assert np.linalg.norm(push["force_n"]) == pytest.approx(np.hypot(0.1, 0.2))
    assert np.dot(push["force_n"], push["normal"]) < -0.8 * np.hypot(0.1, 0.2)
    touched = replace(run.scene, loads=Loads(contact={}))
    with pytest.raises(InputError, match="poke is touched; leave --seed out"):
        motions.drawn(touched, 7)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            lambda u: u[:, :3],
            r"displacement_m has the shape \(1, 3, \d+, 3\); give \(1, 4, \d+, 3\): questions, instants",
        ),
        (lambda u: 1000 * u, r"as if in millimetres; give metres"),
        (lambda u: np.where(u == u[0, 1, 5, 2], np.nan, u), r"displacement_m is not finite in question 0"),
    ],
)
def test_faulty_motions_have_one_sentence(folder, answered, tmp_path, change, said):
    questions = read(folder)
    with np.load(answered) as file:
        found = {name: file[name] for name in file.files}
    found["setting_2/displacement_m"] = change(found["setting_2/displacement_m"])
    (tmp_path / "a.npz").write_bytes(packed(found))
    with pytest.raises(InputError, match=said):
        score_answers(tmp_path / "a.npz", questions, questions.truth)


def test_instants_that_begin_at_rest_are_told(run):
    truth = run.truth.displacement
    late = np.concatenate([np.zeros_like(truth[:1]), truth[:-1]])
    assert over_time(late, truth, 0.04) == "is at rest at the first instant; leave out what is at t = 0"
    assert over_time(late + 1e-9, truth, 0.04).startswith("is at each instant that of the one before; leave out")
    assert not over_time(0.9 * truth, truth, 0.04) and not over_time(0.0 * truth, truth, 0.04)


@pytest.mark.parametrize("share", [1.0, 0.6])
def test_what_is_no_motion_over_time_is_told(share):
    """A point that swings to a new rest, also where it is answered too stiff."""
    t = 0.02 * np.arange(1, 11)
    truth = ((1.0 - np.exp(-3.0 * t) * np.cos(8.0 * t))[:, None, None] * [[0.0, 0.0, -1.0], [0.0, 0.0, 0.0]]) * 0.01
    velocity = np.gradient(truth, 0.02, axis=0)
    assert "last instant first" in over_time(share * truth[::-1], truth, 0.02)
    assert "velocity" in over_time(share * velocity, truth, 0.02)
    assert not over_time(share * truth, truth, 0.02)


def test_forces_of_instruments_are_compared_as_those_of_models(run):
    """A ball that presses the bar's top: its force is asked for, and its error is that of dynamic_accuracy.csv."""
    ball = {"kind": "sphere", "center_m": [0.08, 0.02, 0.052], "radius_m": 0.01}
    ball |= {"times_s": [0.0, 0.1], "shifts_m": [[0, 0, 0], [0, 0, -0.01]]}
    scene = replace(run.scene, loads=Loads(contact={"instruments": [ball], "friction": 0.2}))
    questions = motions.questions_of([scene], {"levels": 3, "steps_per_frame": 1})
    load = questions.info["loads"][0]
    assert load["instruments"] == [ball] and load["friction"] == 0.2
    assert motions._loads(load).instruments == [Ball(**ball)]
    assert motions.wanted(questions)["force_n"].shape == (4, 1, 3)
    assert "`setting_0/force_n` | (k, f, i, 3)" in readme(questions, "corotational").decode()
    dent = questions.arrays["loads"]["in_dent"][0]
    assert 0 < dent.sum() < len(dent)
    rng = np.random.default_rng(0)
    moved, force = rng.normal(size=(1, 4, len(dent), 3)), rng.normal(size=(1, 4, 1, 3))
    own = {f"own_{name}": np.array([1e-3]) for name in motions.OWN} | {"own_force_rms_of_peak": np.array([1e-2])}
    truth = own | {"displacement_m": moved, "force_n": force, "seconds": np.ones(1)}
    answers = {"digest": questions.digest, "engine": "a", "version": "1", "hardware": "b", "law": "corotational"}
    answers |= {"settings": ["one"], "converged": [True], "setting_0/displacement_m": 1.01 * moved}
    answers |= {"setting_0/force_n": 1.1 * force, "setting_0/seconds": [2.0], "setting_0/preparation_s": 0.0}
    path = run.results / "touched.npz"
    path.write_bytes(packed({name: np.array(value) for name, value in answers.items()}))
    row = score_answers(path, questions, truth).settings.iloc[0]
    inside = force_errors(1.1 * force[0], force[0])
    assert row["force_rms_of_peak"] == pytest.approx(inside.force_rms_of_peak)
    assert row["force_peak_error"] == pytest.approx(0.1) and row["relative_l2"] == pytest.approx(0.01)


def test_a_motion_whose_truth_is_not_believed_cannot_be_asked(run, tmp_path):
    results = tmp_path / "results"
    (results / "data/dynamic/poke").mkdir(parents=True)
    save(run.scene.body, results / "data/bar/body.h5")
    store(replace(run.truth, rejected="it folds"), results / "data/dynamic/poke/truth.h5")
    with pytest.raises(InputError, match=r"truth.h5 has no truth that is believed \(it folds\)"):
        ask(run.config, results, "poke", None, tmp_path / "q")
    with pytest.raises(InputError, match=r"type make dynamic first, or give --seed"):
        ask(run.config, tmp_path / "none", "poke", None, tmp_path / "q")
    assert isinstance(run.scene, MovingScene)
