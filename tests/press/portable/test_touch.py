"""Touches of rigid instruments: runtimes agree, forces are slopes of the energy, and old files are still read."""

import json
import struct
import subprocess

import numpy as np
import pytest
from press.portable.conftest import repaired

from palpate.press.portable.runtimes.palpate_model import PortableModel, _punch, _Touched

ASK = """
const Palpate = require(process.argv[1]), fs = require("fs"), model = Palpate.load(fs.readFileSync(process.argv[2]));
const found = JSON.parse(fs.readFileSync(process.argv[3])).map(([place, depth, direction]) => {
  const answer = model.touch({place, depth, direction});
  return {...answer, displacement: Array.from(answer.displacement)};
});
fs.writeFileSync(process.argv[4], JSON.stringify(found));
"""
WRONG = """
const model = require(process.argv[1]).load(require("fs").readFileSync(process.argv[2]));
for (const touch of [{place: 2, depth: 0}, {place: 0, depth: -1}, {place: 0, depth: 0, direction: [0, 0, 0]}])
  try { model.touch(touch); console.log("answered"); } catch (error) { console.log(error.message); }
"""


def in_c(file, asked, n, folder, request):
    rows = [[place, depth, way is not None, *(way or [0, 0, 0])] for place, depth, way in asked]
    np.array(rows, dtype=float).tofile(folder / "touches")
    program = request.getfixturevalue("compiled")("ask_touch")
    command = [program, str(file), str(folder / "touches"), str(folder / "answers")]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    data, size, found = (folder / "answers").read_bytes(), 80 + 12 * n + 160, []
    for k in range(len(asked)):
        told, moved = np.frombuffer(data, float, 10, size * k), np.frombuffer(data, np.float32, 3 * n, size * k + 80)
        doubt = data[size * k + 80 + 12 * n : size * (k + 1)].split(b"\0")[0].decode()
        found.append((moved.reshape(-1, 3), told[:3], told[3], told[4], told[5:8], told[8], doubt))
    return found


def in_javascript(file, asked, n, folder, request):
    (folder / "touches").write_text(json.dumps(asked))
    request.getfixturevalue("node")(ASK, file, folder / "touches", folder / "answers")
    answers = json.loads((folder / "answers").read_text())
    keys = ("force", "forceAlong", "area", "tip", "forceError", "doubt")
    return [(np.reshape(each["displacement"], (-1, 3)), *(each[key] for key in keys)) for each in answers]


@pytest.mark.parametrize("runtime", [pytest.param(in_c, marks=pytest.mark.slow), in_javascript])
def test_runtimes_answer_touches_as_python(runtime, made_up, touched, asked, request, tmp_path):
    (tmp_path / "model").write_bytes(made_up.touched)
    expected = [touched.touch(*each) for each in asked]
    assert 20 < sum(not each.doubt for each in expected) < 50
    found = runtime(tmp_path / "model", asked, len(touched.nodes), tmp_path, request)
    for right, (moved, force, along, area, tip, force_error, doubt) in zip(expected, found, strict=True):
        assert np.abs(moved - right.displacement).max() <= 1e-6 * max(np.abs(right.displacement).max(), 1e-6)
        assert force == pytest.approx(right.force, rel=1e-6, abs=1e-6 * max(np.abs(right.force).max(), 1e-6))
        assert along == pytest.approx(right.force_n, rel=1e-6, abs=1e-9)
        assert area == pytest.approx(right.area_m2) and tip == pytest.approx(right.tip, abs=1e-12)
        assert doubt == right.doubt and force_error == pytest.approx(right.force_error)


def test_forces_grow_with_depth_and_are_the_slope_of_the_energy(touched):
    """By central differences of what is stored in cells and contact, which the instrument's work has put there."""
    for number, place in enumerate(touched.touches):
        way = -place.axes[2]
        forces = [touched.touch(number, depth).force_n for depth in (0.0, 0.002, 0.004, 0.006)]
        assert np.isfinite(forces).all() and np.all(np.diff(forces) > 0.0)
        stored, step = [], 1e-6
        for depth in (0.004 - step, 0.004 + step):
            tip = touched.nodes[place.node] + (place.first[0] + depth) * way
            q = np.linalg.lstsq(place.surface, touched.touch(number, depth).displacement.ravel())[0]
            stored.append(_Touched(place, tip, q).energy)
        assert forces[2] == pytest.approx((stored[1] - stored[0]) / (2.0 * step), rel=1e-4)


def test_the_stiffness_is_that_of_the_energy(touched):
    for place in touched.touches:
        tip = touched.nodes[place.node] - 0.003 * place.axes[2] + 0.001 * place.axes[0]
        q = 0.04 * np.random.default_rng(2).normal(size=6)
        steps = 1e-6 * np.eye(6)
        pairs = [(_Touched(place, tip, q + step), _Touched(place, tip, q - step)) for step in steps]
        here = _Touched(place, tip, q)
        slopes = np.array([(one.energy - two.energy) / 2e-6 for one, two in pairs])
        assert here.gradient == pytest.approx(slopes, abs=1e-6 * np.abs(slopes).max())
        bends = np.array([(one.gradient - two.gradient) / 2e-6 for one, two in pairs])
        assert sum(here.stiffness()) == pytest.approx(bends, abs=1e-5 * np.abs(bends).max())


def test_a_ball_is_a_punch_whose_edge_is_its_radius(touched):
    """Against distances from a centre, and gradients and curvatures by differences, on its lower half."""
    rng, (ball, punch) = np.random.default_rng(3), touched.touches
    at = 0.6 * ball.radius_m * rng.uniform(-1.0, 1.0, size=(40, 3))
    gaps, normals, _ = _punch(ball, at)
    away = at - ball.radius_m * ball.axes[2]
    assert gaps == pytest.approx(np.linalg.norm(away, axis=1) - ball.radius_m)
    assert normals == pytest.approx(away / np.linalg.norm(away, axis=1)[:, None])
    at = 0.02 * rng.uniform(-1.0, 1.0, size=(40, 3))
    for place in (ball, punch):
        _, normals, around = _punch(place, at)
        bends = sum(curves[:, None, None] * way[:, :, None] * way[:, None, :] for way, curves in around)
        for d in range(3):
            step = 1e-7 * np.eye(3)[d]
            (ahead, one, _), (back, two, _) = _punch(place, at + step), _punch(place, at - step)
            assert (ahead - back) / 2e-7 == pytest.approx(normals[:, d], abs=1e-5)
            assert (one - two) / 2e-7 == pytest.approx(bends[:, d], abs=1e-3 * np.abs(bends).max())


def test_doubts_say_what_is_beyond_what_was_prepared(touched):
    way = [0.8, 0.0, -0.6]
    assert "deeper than the 6.0 mm" in touched.touch(0, 0.0061).doubt
    assert "more than 45 degrees" in touched.touch(1, 0.003, np.array(way) @ touched.touches[1].axes).doubt
    most = touched.touch(0, 1e200)
    assert most.error == 1.0 and "beyond what can be stored" in most.doubt and not most.displacement.any()
    none = touched.touch(0, 0.0)
    assert abs(none.force_n) < 0.3 * touched.touch(0, 0.003).force_n and none.doubt == ""


@pytest.mark.parametrize(
    ("wrong", "said"),
    [((2, 0.0), "place 2"), ((0, -1.0), "depth"), ((0, np.nan), "depth"), ((0, 0.0, [0, 0, 0]), "length")],
)
def test_what_is_no_touch_is_refused_in_words(touched, wrong, said):
    with pytest.raises(ValueError, match=said):
        touched.touch(*wrong)


def test_without_places_there_is_none_to_touch_and_javascript_refuses_as_python(model, made_up, node, tmp_path):
    with pytest.raises(ValueError, match="place 0, which is not there"):
        model.touch(0, 0.001)
    (tmp_path / "model").write_bytes(made_up.touched)
    said = node(WRONG, tmp_path / "model").splitlines()
    assert len(said) == 3 and "place 2" in said[0] and "depth" in said[1] and "length" in said[2]


@pytest.mark.slow
def test_files_of_version_1_are_read_and_places_cost_others_nothing(made_up, touched, model, compiled, tmp_path):
    """A file without places differs from an old one by its version alone; presses are answered as before."""
    old = repaired(made_up.data[:8] + struct.pack("<I", 1) + made_up.data[12:])
    press = {"triangle": 7, "weights": [0.2, 0.3, 0.5], "force": [0.0, 0.0, -0.2]}
    right = model.respond([press]).displacement
    for each in (PortableModel(old), touched):
        assert np.array_equal(each.respond([press]).displacement, right)
    assert PortableModel(old).touches == [] and len(touched.touches) == 2
    (tmp_path / "old").write_bytes(old)
    np.array([1.0, 7, 0.2, 0.3, 0.5, 0, 0, 0, -0.2]).tofile(tmp_path / "loads")
    files = [str(tmp_path / name) for name in ("old", "loads", "answers")]
    assert subprocess.run([compiled("ask"), *files]).returncode == 0
    in_c = np.frombuffer((tmp_path / "answers").read_bytes(), np.float32, right.size, 48).reshape(-1, 3)
    assert np.abs(in_c - right).max() < 1e-5 * np.abs(right).max()


@pytest.mark.parametrize(
    ("at", "value", "said"),
    [
        (0, 10**6, "sizes"),
        (4, 7, "sizes"),
        (8, 0, "sizes"),
        (16, 10**5, "sizes"),
        (32, 0x80000000, "lengths|deepest|none"),
    ],
)
def test_a_place_that_is_none_is_refused(at, value, said, made_up):
    begin = len(made_up.data)
    data = made_up.touched[: begin + at] + struct.pack("<I", value) + made_up.touched[begin + at + 4 :]
    with pytest.raises(ValueError, match=said):
        PortableModel(repaired(data))
