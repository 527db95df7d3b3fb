"""A knife in the live page: models follow its cuts, are whole again without, and say which cuts they refuse."""

import base64
import json
from dataclasses import replace

import numpy as np
import pytest

from palpate.benchmark.load import Load
from palpate.bodies.cutting.settings import CutSettings
from palpate.errors import InputError
from palpate.models.kinds import FEM
from palpate.press.serve.knife import KnifeModel, read_cuts
from palpate.press.serve.live_models import LiveModels
from palpate.press.serve.pressed_model import Asked


def skewed(x: float, y: float, z: float = 0.08) -> list[float]:
    """A point of the slab, 20 cm long, 10 cm wide and 8 cm high before it was skewed, and held at x = 0."""
    return [x, 0.05 * x + y + 0.07 * z, 0.1 * x + 0.15 * y + z]


PATH = [skewed(0.11, -0.04), skewed(0.11, 0.14)]
CUT = [{"path_m": PATH, "depth_m": 0.06}]
SEVERED = [{"path_m": PATH, "depth_m": 0.12}]


def surface(live: LiveModels, name: str, cuts: list) -> dict:
    """Return what the server says of a cut, unpacked."""
    said = json.loads(live.cut(name, json.dumps({"cuts": cuts}).encode()))
    kinds = {"nodes": "<f4", "triangles": "<u4", "held": "u1"}
    arrays = {key: np.frombuffer(base64.b64decode(said[key]), kind) for key, kind in kinds.items()}
    return said | arrays | {key: arrays[key].reshape(-1, 3) for key in ("nodes", "triangles")}


def moved(live: LiveModels, name: str, cuts: list, presses: list) -> tuple[np.ndarray, np.ndarray]:
    said = json.loads(live.answer_cut(name, json.dumps({"presses": presses, "cuts": cuts}).encode()))
    return np.frombuffer(base64.b64decode(said["displacement"]), "<f4").reshape(-1, 3), np.array(said["forces"])


def on_top(found: dict, x: float) -> dict:
    """Return the place of a triangle of the top, near ``x`` [m] along the middle."""
    middles = found["nodes"][found["triangles"]].mean(axis=1)
    near = np.linalg.norm(middles - skewed(x, 0.05), axis=1)
    return {"triangle": int(near.argmin()), "weights": [1 / 3, 1 / 3, 1 / 3]}


@pytest.mark.parametrize("name", ["cut_elements", "cut_linear"])
def test_lips_open_as_their_side_is_pulled_and_the_body_is_whole_again_without_cuts(live, name):
    before = surface(live, name, [])
    pull = {"moved": [0.004, 0.0, 0.0]}
    whole, force = moved(live, name, [], [on_top(before, 0.15) | pull])
    cut = surface(live, name, CUT)
    assert len(before["nodes"]) == before["skin"] < cut["skin"] < len(cut["nodes"])
    found, less = moved(live, name, CUT, [on_top(cut, 0.15) | pull])
    lips, places = found[cut["skin"] :], cut["nodes"][cut["skin"] :]
    at_mouth = np.linalg.norm(places - skewed(0.11, 0.05), axis=1) < 0.015
    along = lips[at_mouth, 0]
    assert 0.001 < np.ptp(along) < 0.006 and along.min() > -1e-3  # the held side hardly follows
    assert 0.0 < less[0, 0] < 0.9 * force[0, 0]
    again = surface(live, name, [])
    assert (again["nodes"] == before["nodes"]).all() and (again["triangles"] == before["triangles"]).all()
    assert np.abs(moved(live, name, [], [on_top(before, 0.15) | pull])[0] - whole).max() < 1e-6 * np.abs(whole).max()


def test_uncut_it_answers_as_elements_of_the_level_do(live):
    case = live.case
    contact, force = int(case.database.contact[0]), 0.2 * case.database.force[0]
    row = int(np.searchsorted(case.body.fine.surface, contact))
    triangle, corner = (int(each[0]) for each in np.nonzero(case.database.triangles == row))
    expected = FEM(order=1, level=1, tolerance=1e-9).prepare(case).respond(Load.at(contact, force))
    found = KnifeModel(case, linear=False).respond([Asked(triangle, np.eye(3)[corner], force, None)])
    assert np.abs(found.displacement - expected).max() < 2e-3 * np.abs(expected).max()
    small = 1e-4 * force  # where strains are small, both models are one
    both = [KnifeModel(case, linear).respond([Asked(triangle, np.eye(3)[corner], small, None)]) for linear in (0, 1)]
    assert np.abs(both[0].displacement - both[1].displacement).max() < 1e-3 * np.abs(both[1].displacement).max()


def test_a_force_and_the_way_that_it_moves_a_disc_are_one_answer(live):
    cut = surface(live, "cut_linear", CUT)
    place = on_top(cut, 0.15)
    by_way, force = moved(live, "cut_linear", CUT, [place | {"moved": [0.002, 0.0, 0.001]}])
    by_force, _ = moved(live, "cut_linear", CUT, [place | {"force": force[0].tolist()}])
    assert np.abs(by_way - by_force).max() < 1e-6 * np.abs(by_way).max()


def test_a_piece_cut_free_stays_and_is_not_pressed(live):
    cut = surface(live, "cut_linear", SEVERED)
    assert cut["held"].any() and not cut["held"][cut["nodes"][:, 0] > 0.15].any()
    with pytest.raises(InputError, match="cut free and hangs from nothing; make the body whole"):
        moved(live, "cut_linear", SEVERED, [on_top(cut, 0.15) | {"force": [0, 0, -0.1]}])
    left, _ = moved(live, "cut_linear", SEVERED, [on_top(cut, 0.05) | {"force": [0, 0, -0.1]}])
    assert np.abs(left[cut["nodes"][:, 0] > 0.12]).max() == 0.0 < np.abs(left).max()


@pytest.mark.parametrize(
    ("cuts", "said"),
    [
        (
            [{"path_m": [skewed(0.11, 0.02, 0.3), skewed(0.11, 0.08, 0.3)], "depth_m": 0.05}],
            "cut 1 lies outside the body",
        ),
        ([{"path_m": PATH, "depth_m": 0.0}], "this cut severs nothing, as elements are 30 mm long"),
        ([CUT[0], {"path_m": [skewed(0.17, 0.05), skewed(0.171, 0.05)], "depth_m": 0.01}], "this cut severs nothing"),
        ([{"path_m": [skewed(0.0, 0.05)], "depth_m": 0.05}], "has one point; give two or more"),
    ],
)
def test_a_cut_that_opens_nothing_is_refused_and_leaves_the_body_as_it_is(live, cuts, said):
    model = live.knife("cut_linear")
    made = [CutSettings(**each) for each in CUT]
    before = model.follow(made).surface
    with pytest.raises(InputError, match=said):
        live.cut("cut_linear", json.dumps({"cuts": cuts}).encode())
    assert model.follow(made).surface is before


@pytest.mark.slow
def test_random_drags_are_answered_or_refused(live):
    """Kinked, crossing, grazing: what is drawn encloses the body, and what is answered is finite."""
    rng, model, answered = np.random.default_rng(2), live.knife("cut_linear"), 0
    skin, volume = live.case.meshes.nodes_fine_surface, live.case.body.fine.volumes.sum()
    for _ in range(20):
        paths = [skin[rng.integers(len(skin), size=rng.integers(2, 5))] for _ in range(rng.integers(1, 4))]
        try:
            surface = model.follow(
                [CutSettings(path_m=path.tolist(), depth_m=rng.uniform(0.01, 0.08)) for path in paths]
            ).surface
            press = Asked(
                int(rng.integers(len(surface.triangles))), np.full(3, 1 / 3), None, 0.002 * rng.normal(size=3)
            )
            found = model.respond([press])
        except InputError:
            continue
        answered += 1
        a, b, c = np.swapaxes(surface.nodes[surface.triangles], 0, 1)
        assert np.einsum("ij,ij->", np.cross(a, b), c) / 6.0 == pytest.approx(volume, rel=1e-6)
        assert np.isfinite(found.displacement).all() and np.isfinite(found.forces).all()
    assert answered >= 10


def test_a_cut_where_the_body_is_held_is_refused(slab_case):
    case = slab_case[0]
    body = case.body
    held = replace(body, anchors=[np.flatnonzero(mesh.nodes[:, 0] < 0.151) for mesh in body.levels])
    model = KnifeModel(replace(case, body=held), linear=True)
    with pytest.raises(InputError, match="the body is held there, and a cut opens nothing; cut another place"):
        model.follow([CutSettings(path_m=[skewed(0.06, -0.01), skewed(0.06, 0.11)], depth_m=0.06)])


@pytest.mark.parametrize(
    "sent",
    [
        "[]",
        '{"cuts": 3}',
        '{"cuts": [{"path_m": [[0, 0], [1, 1]], "depth_m": 0.1}]}',
        '{"cuts": [{"path_m": [[0, 0, 0], [NaN, 1, 1]], "depth_m": 0.1}]}',
        '{"cuts": [{"path_m": [[0, 0, 0], [1, 1, 1]], "depth_m": -0.1}]}',
        '{"cuts": [{"path_m": [[0, 0, 0], [1, 1, 1]], "depth_m": 0.1, "at_s": 1}]}',
        '{"cuts": [{"path_m": [], "depth_m": 0.1}]}',
    ],
)
def test_whatever_else_is_sent_for_a_cut_is_refused(sent):
    with pytest.raises(InputError, match=r"post \{.cuts.: "):
        read_cuts(sent.encode())
